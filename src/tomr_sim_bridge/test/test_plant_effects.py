"""Each effect of the vocabulary, as the simulated robot does it."""

import math
from collections.abc import Callable

import attrs
import numpy as np
import pytest

from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.effects import (
    DriverPower,
    PlantEffect,
    make_effects,
    plant_effects,
)
from tomr_sim_bridge.plant.simulation import Simulation

MakeRobot = Callable[..., Robot]
COMMAND = (0.0, 0.4, 0.0)
SPEED = np.array([-8.0, 4.0, 4.0])  # rad/s of the wheels, by hand
ACROSS = np.array([0.0, 0.34641, 0.34641])  # m/s of the contacts along their axles
LOAD = 15.0 * 9.80665 / 3.0  # N on each wheel
RESISTANCE, CONSTANT = 0.8, 0.7  # ohm, N m/A at the wheel


def expected_power(extra_torque: np.ndarray) -> np.ndarray:
    """Motor powers at steady speed with a torque on top of the reference robot's friction."""
    current = (0.06 + 0.004 * np.abs(SPEED) + extra_torque) / CONSTANT
    return CONSTANT * current * np.abs(SPEED) + RESISTANCE * current**2 + 1.2


def named(effect_id: str, **parameters: float) -> dict[str, float]:
    return {f"physics.{effect_id}.{key}": value for key, value in parameters.items()}


@pytest.mark.parametrize(
    ("changes", "torque"),
    [
        ({}, 0.0 * SPEED),
        (named("friction.coulomb", torque=0.12), 0.06 + 0.0 * SPEED),
        (named("friction.viscous", coefficient=0.014), 0.01 * np.abs(SPEED)),
        (
            named("friction.stribeck", torque=0.05, speed=8.0),
            0.05 * np.exp(-((SPEED / 8.0) ** 2)),
        ),
        (named("friction.asymmetric", torque=0.03), 0.03 * np.sign(SPEED)),
        (
            named("friction.load_dependent", coefficient=0.25),
            # transmitted = friction / (1 - coefficient) at steady speed
            (0.06 + 0.004 * np.abs(SPEED)) * (1 / 0.75 - 1.0),
        ),
        (named("friction.quadratic", coefficient=0.001), 0.001 * SPEED**2),
        (named("contact.rolling_resistance", coefficient=0.02), 0.02 * LOAD * 0.05 + 0.0 * SPEED),
        (
            named("electrical.iron_loss", hysteresis=0.001, eddy=1e-5),
            0.001 * 20.0 + 1e-5 * 400.0 * np.abs(SPEED),
        ),
    ],
    ids=lambda value: str(next(iter(value), "none")) if isinstance(value, dict) else "",
)
def test_resistance_costs_what_its_formula_says(
    changes: dict[str, float], torque: np.ndarray, make_robot: MakeRobot, drive: Callable
) -> None:
    run = drive(Simulation(make_robot(changes, ideal=True), seed=1), 3.0, COMMAND, skip=1.5)
    assert run.motors().mean(axis=0) == pytest.approx(expected_power(torque), rel=0.03)


def test_slow_wheels_feel_all_of_their_dry_friction(make_robot: MakeRobot, drive: Callable) -> None:
    """At 0.4 and 0.2 rad/s; a friction that yields would brake as if it were viscous."""
    stribeck = named("friction.stribeck", torque=0.8, speed=1.0)
    slow = tuple(0.05 * part for part in COMMAND)
    run = drive(Simulation(make_robot(stribeck, ideal=True), seed=1), 4.0, slow, skip=2.0)
    speed = 0.05 * np.abs(SPEED)
    current = (0.06 + 0.004 * speed + 0.8 * np.exp(-(speed**2))) / CONSTANT
    expected = CONSTANT * current * speed + RESISTANCE * current**2 + 1.2
    assert run.motors().mean(axis=0) == pytest.approx(expected, rel=0.02)


def test_roller_drag_costs_force_times_sliding(make_robot: MakeRobot, drive: Callable) -> None:
    drag = named("contact.roller_drag", coefficient=0.03)
    with_drag, without = (
        drive(Simulation(make_robot(changes, ideal=True), seed=1), 3.0, COMMAND, skip=1.5)
        .motors()
        .sum(axis=1)
        .mean()
        for changes in (drag, {})
    )
    force_times_speed = 0.03 * LOAD * ACROSS.sum()  # 1.019 W
    # 2.55 N in all, shared 2 : 1 : 1 by the wheels: 0.085 and 0.0425 N m more on 0.092 and 0.076
    copper = RESISTANCE / CONSTANT**2 * (0.177**2 - 0.092**2 + 2 * (0.1185**2 - 0.076**2))
    assert with_drag - without == pytest.approx(force_times_speed + copper, rel=0.02)


def test_slope_costs_the_climb(make_robot: MakeRobot, drive: Callable) -> None:
    def total(azimuth: float) -> float:
        slope = named("body.slope", angle=0.05, azimuth=azimuth)
        run = drive(Simulation(make_robot(slope, ideal=True)), 3.0, COMMAND, skip=1.5)
        return float(run.motors().sum(axis=1).mean())

    climb = 15.0 * 9.80665 * math.sin(0.05) * 0.4  # W
    # 2.94 W shared by the squares of the wheel speeds: 0.245 and twice 0.1225 N m on 0.092 and
    # 0.076 of friction; their product is in the copper loss, up and down with opposite signs.
    copper = RESISTANCE / CONSTANT**2 * 4.0 * (0.092 * 0.245 + 2 * 0.076 * 0.1225)
    up, down = total(-math.pi / 2), total(math.pi / 2)
    assert up - down == pytest.approx(2.0 * climb + copper, rel=0.003)


def test_torque_ripple_follows_the_wheel_angle(make_robot: MakeRobot, drive: Callable) -> None:
    ripple = named("drivetrain.torque_ripple", torque=0.2, order=3.0, phase=0.5)
    run = drive(Simulation(make_robot(ripple, ideal=True)), 6.0, (0.0, 0.05, 0.0), skip=3.0)
    every = round(100.0 / 50.0)  # encoders against power readings
    angle = run.joints("position")[::every][: len(run.motors())]
    wave = np.sin(3.0 * angle[:, 1] + 0.5)
    assert np.corrcoef(wave, run.motors()[:, 1])[0, 1] > 0.9  # wheel 2 turns forward


def test_a_larger_wheel_moves_the_robot_off_its_command(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot({"physics.kinematic.wheel_radius.wheel_1_joint.scale": 1.03}, ideal=True)
    run = drive(Simulation(robot), 4.0, (0.0, 0.3, 0.0), skip=3.0)
    assert run.joints().mean(axis=0) == pytest.approx([-6.0, 3.0, 3.0], abs=0.012)
    # 3 % of 0.3 m/s too much at wheel 1 alone: v_y + 2/3 of it, yaw + 1/3 of it over R
    assert run.twist().mean(axis=0) == pytest.approx([0.0, 0.306, 0.015], abs=0.001)


def test_payload_slows_the_start_that_traction_allows(
    make_robot: MakeRobot, drive: Callable
) -> None:
    def energy(changes: dict[str, float]) -> float:
        simulation = Simulation(make_robot(changes))
        drive(simulation, 2.5, (0.0, 0.5, 0.0))
        return simulation.engine.kinetic_energy

    added = energy(named("body.payload_mass", mass=5.0)) - energy({})
    assert added == pytest.approx(0.5 * 5.0 * 0.5**2, rel=0.02)


def test_windings_heat_up(make_robot: MakeRobot) -> None:
    heating = "electrical.winding_heating"
    robot = make_robot(named(heating, thermal_resistance=10.0, time_constant=2.0))
    effect = next(effect for effect in make_effects(robot) if effect.effect_id == heating)
    resistance = np.full(3, 0.8)
    for _ in range(4000):  # 20 s at 2 A
        drivers = DriverPower(0.005, np.full(3, 2.0), np.zeros(3), np.zeros(3), resistance)
        effect.bill(drivers)
        resistance = drivers.resistance
    # R = 0.8 ohm * (1 + 0.00393 /K * 10 K/W * 4 A^2 * R)
    assert resistance == pytest.approx(0.8 / (1.0 - 0.8 * 0.00393 * 10.0 * 4.0), rel=1e-3)


def test_windings_that_start_warm_cool_down_at_rest(make_robot: MakeRobot) -> None:
    heating = "electrical.winding_heating"
    values = {"thermal_resistance": 10.0, "time_constant": 2.0, "initial": 50.0}
    robot = make_robot(named(heating, **values))
    effect = next(effect for effect in make_effects(robot) if effect.effect_id == heating)
    drivers = DriverPower(0.005, np.zeros(3), np.zeros(3), np.zeros(3), np.full(3, 0.8))
    for _ in range(400):  # 2 s: one time constant
        effect.bill(drivers)
    expected = 0.8 * (1.0 + 0.00393 * 50.0 * math.exp(-1.0))
    assert drivers.resistance == pytest.approx(np.full(3, expected), rel=1e-4)


def test_supply_sags_under_load(make_robot: MakeRobot, drive: Callable) -> None:
    robot = make_robot(named("electrical.supply_sag", resistance=0.5), ideal=True)
    run = drive(Simulation(robot), 0.5)
    voltage = run.supply("battery_state", "voltage").mean()
    current = -run.supply("battery_state", "current").mean()
    assert voltage == pytest.approx(24.0 - 0.5 * current, rel=1e-4)
    assert voltage * current == pytest.approx(12.0 + 3 * 1.2, rel=1e-3)


def test_driver_losses_are_billed(make_robot: MakeRobot) -> None:
    losses = {
        **named("electrical.switching_loss", coefficient=0.5),
        **named("electrical.regeneration_loss", efficiency=0.6),
    }
    current, motor = np.array([2.0, -2.0, 0.0]), np.array([10.0, -10.0, 0.0])
    drivers = DriverPower(0.005, current, motor, motor.copy(), np.full(3, 0.8))
    for effect in make_effects(make_robot(losses)):
        effect.bill(drivers)
    # 10 + 0.5 * 2 + 1.2 standby; -10 * 0.6 + 1 + 1.2; 1.2
    assert drivers.power == pytest.approx([12.2, -3.8, 1.2])


def test_every_effect_of_the_vocabulary_is_there() -> None:
    assert plant_effects() == sorted(EFFECTS)


def test_unknown_effect_is_refused(make_robot: MakeRobot) -> None:
    robot = attrs.evolve(make_robot(), physics={"friction.magic": (None, None, None)})
    with pytest.raises(InputError, match=r"friction\.magic.*leave it out; it can do.*coulomb"):
        Simulation(robot)


def test_readings_of_the_future_are_refused(make_robot: MakeRobot) -> None:
    with pytest.raises(InputError, match=r"delay = -0\.1 s .* give a delay of 0 or more"):
        Simulation(make_robot(named("sensor.clock_offset", delay=-0.1)))


def test_an_effect_does_nothing_unless_it_says_so(make_robot: MakeRobot) -> None:
    effect = PlantEffect(make_robot())
    drivers = DriverPower(0.005, np.ones(3), np.ones(3), np.ones(3), np.ones(3))
    effect.bill(drivers)
    assert drivers.power == pytest.approx([1.0, 1.0, 1.0])
