"""The simulated robot as a body: masses, kinematics, energy, repeatability."""

import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot, shipped_robot, shipped_robots
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects import make_effects
from tomr_sim_bridge.plant.mjcf import ROLLERS, build_model, roller_semi_axes
from tomr_sim_bridge.plant.simulation import Simulation, TimeGrid

MakeRobot = Callable[..., Robot]


def totals(robot: Robot) -> tuple[float, np.ndarray, float]:
    """Mass, mass centre and inertia about the vertical through it, summed over all bodies."""
    design = PlantDesign.of(robot)
    for effect in make_effects(robot):
        effect.shape(design)
    model = build_model(robot, design, 0.001)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = model.body_mass
    center = mass @ data.xipos / mass.sum()
    inertia = 0.0
    for body in range(1, model.nbody):
        axes = data.ximat[body].reshape(3, 3)
        inertia += (axes @ np.diag(model.body_inertia[body]) @ axes.T)[2, 2]
        inertia += mass[body] * float(np.sum((data.xipos[body] - center)[:2] ** 2))
    return float(mass.sum()), center, inertia


@pytest.mark.parametrize("name", shipped_robots())
def test_shipped_robots_have_exactly_the_described_mass(name: str) -> None:
    robot = shipped_robot(name)
    mass, center, inertia = totals(robot)
    assert mass == pytest.approx(robot.mass, rel=1e-12)
    assert center == pytest.approx(robot.mass_center, abs=1e-12)
    assert inertia == pytest.approx(robot.inertia_z, rel=1e-9)


def test_mass_stays_exact_off_centre_and_with_load(make_robot: MakeRobot) -> None:
    robot = make_robot(
        {
            "robot.mass_center": [0.02, -0.01, 0.1],
            "physics.body.mass_center_offset.x": 0.01,
            "physics.body.mass_center_offset.y": 0.03,
            "physics.body.payload_mass.mass": 4.0,
            "physics.kinematic.wheel_radius.wheel_2_joint.scale": 1.04,
        }
    )
    mass, center, inertia = totals(robot)
    assert mass == pytest.approx(19.0, rel=1e-12)
    assert center == pytest.approx([0.03, 0.02, 0.1], abs=1e-12)
    assert inertia == pytest.approx(0.35, rel=1e-9)


def test_hub_and_rollers_have_the_inertia_of_the_wheel(make_robot: MakeRobot) -> None:
    model = build_model(make_robot(), PlantDesign.of(make_robot()), 0.001)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hub = model.body("hub_0").id  # its axle lies along x
    bodies = [hub, *(model.body(f"roller_0_{number}").id for number in range(ROLLERS))]
    inertia = 0.0
    for body in bodies:
        axes = data.ximat[body].reshape(3, 3)
        inertia += (axes @ np.diag(model.body_inertia[body]) @ axes.T)[0, 0]
        inertia += model.body_mass[body] * np.sum((data.xipos[body] - data.xipos[hub])[1:] ** 2)
    assert inertia == pytest.approx(6.0e-4, rel=1e-9)
    # 5.0e-6 kg m^2 behind a gear of 20
    assert model.dof_armature[model.joint("wheel_0").dofadr[0]] == pytest.approx(2.0e-3)


def test_masses_that_leave_nothing_for_the_body_are_refused(make_robot: MakeRobot) -> None:
    with pytest.raises(InputError, match=r"robot\.inertia_z = 0\.001 .* raise it"):
        Simulation(make_robot({"robot.inertia_z": 0.001}))


def test_rollers_make_a_round_wheel() -> None:
    radial, tangential = roller_semi_axes(0.05)
    tilt = np.linspace(0.0, math.pi / ROLLERS, 200)
    reach = (0.05 - radial) * np.cos(tilt)
    reach += np.hypot(radial * np.cos(tilt), tangential * np.sin(tilt))
    assert np.abs(reach / 0.05 - 1.0).max() < 3e-4
    assert tangential == pytest.approx(0.0320, abs=1e-4)


# Worked by hand: R = 0.2 m, r = 0.05 m, wheels at 0, 120, 240 degrees.
@pytest.mark.parametrize(
    ("command", "speeds"),
    [
        ((0.3, 0.0, 0.0), (0.0, 5.19615, -5.19615)),
        ((0.0, 0.3, 0.0), (-6.0, 3.0, 3.0)),
        ((0.0, 0.0, 1.0), (-4.0, -4.0, -4.0)),
        ((0.2, -0.1, 0.5), (0.0, 0.46410, -6.46410)),
    ],
)
def test_wheels_turn_and_the_robot_moves_as_the_contract_says(
    command: tuple[float, float, float], speeds: tuple[float, float, float],
    make_robot: MakeRobot, drive: Callable,
) -> None:  # fmt: skip
    run = drive(Simulation(make_robot(ideal=True)), 5.0, command, skip=3.0)
    size = np.abs(speeds).max()
    assert run.joints().mean(axis=0) == pytest.approx(speeds, abs=0.002 * size)
    rim = np.array([1.0, 1.0, 0.2])  # yaw rates as speeds at the wheels
    within = 0.002 * np.abs(command * rim).max()
    for topic in ("ground_truth/odom", "odom"):
        assert run.twist(topic).mean(axis=0) * rim == pytest.approx(command * rim, abs=within)


def test_wheel_offset_turns_the_wheels(make_robot: MakeRobot, drive: Callable) -> None:
    robot = make_robot({"robot.wheel_offset": math.pi / 2}, ideal=True)
    run = drive(Simulation(robot), 4.0, (0.3, 0.0, 0.0), skip=3.0)
    # wheels at 90, 210, 330 degrees: the first lies across, rolling forward
    assert run.joints().mean(axis=0) == pytest.approx([6.0, -3.0, -3.0], abs=0.012)


def test_turning_robot_and_command_by_a_third_only_permutes_power(
    make_robot: MakeRobot, drive: Callable
) -> None:
    heading, third = 0.4, 2.0 * math.pi / 3.0
    means = []
    for angle in (heading, heading + third):
        command = (0.4 * math.cos(angle), 0.4 * math.sin(angle), 0.0)
        run = drive(Simulation(make_robot(ideal=True)), 5.0, command, skip=2.5)
        means.append(run.motors().mean(axis=0))
    # what wheel 1 did, wheel 2 does now
    assert np.roll(means[0], 1) == pytest.approx(means[1], rel=0.02)


@pytest.mark.parametrize(("timeout", "standing"), [(0.0, False), (0.5, True)])
def test_a_command_is_held_or_times_out(
    timeout: float, standing: bool, make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True), command_timeout=timeout)
    moving = drive(simulation, 0.5, (0.0, 0.4, 0.0), skip=0.4).joints()
    later = drive(simulation, 1.0, skip=0.8).joints()
    assert np.abs(moving).max() > 7.0
    assert (np.abs(later).max() < 0.05) == standing


def test_energy_is_accounted_for(make_robot: MakeRobot) -> None:
    simulation = Simulation(make_robot(), seed=5)
    for count, command in enumerate(
        [(0.5, 0.0, 0.0), (-0.2, 0.4, 0.5), (0.0, 0.0, -1.0), (0.3, 0.3, 0.0)]
    ):
        simulation.command(*command)
        simulation.step_to((count + 1) * 1_500_000_000)
        ledger = simulation.ledger
        spent = ledger.copper + ledger.axles + simulation.engine.kinetic_energy
        assert ledger.motors == pytest.approx(spent, rel=0.025)
    assert ledger.drivers == pytest.approx(ledger.motors + 3 * 1.2 * 6.0)  # standby of 6 s


def test_power_at_steady_speed_agrees_with_a_hand_calculation(
    make_robot: MakeRobot, drive: Callable
) -> None:
    run = drive(Simulation(make_robot(ideal=True)), 5.0, (0.0, 0.4, 0.0), skip=2.0)
    # Wheel 1 at 8 rad/s: 0.06 + 0.004 * 8 = 0.092 N m, 0.1314 A of 0.7 N m/A,
    # 0.736 W mechanical, 0.0138 W in 0.8 ohm, 1.2 W standby.
    assert run.motors()[:, 0].mean() == pytest.approx(1.950, rel=0.02)
    assert run.power("battery_state").mean() == pytest.approx(
        run.motors().sum(axis=1).mean() + 12.0, rel=1e-6
    )


def test_current_is_negative_while_drawing_and_positive_while_braking(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot({"robot.mass": 40.0}, ideal=True))
    start = drive(simulation, 0.4, (0.0, 0.8, 0.0))
    assert start.supply("wheel_1/power", "current").min() < -1.0
    drive(simulation, 1.5)
    stop = drive(simulation, 0.3, (0.0, 0.0, 0.0))
    assert stop.supply("wheel_1/power", "current").max() > 0.1


def test_same_seed_same_samples(make_robot: MakeRobot) -> None:
    def samples(seed: int) -> list:
        simulation = Simulation(make_robot(), seed, stamp_jitter=0.001)
        simulation.command(0.3, 0.1, 0.2)
        simulation.set_fault("floor_slippery", severity=0.9)
        return simulation.step_to(400_000_000)

    assert repr(samples(3)) == repr(samples(3))
    assert repr(samples(3)) != repr(samples(4))


def test_cutting_a_run_into_pieces_changes_nothing(make_robot: MakeRobot) -> None:
    whole, pieces = Simulation(make_robot()), Simulation(make_robot())
    for simulation in (whole, pieces):
        simulation.command(0.3, 0.0, 0.0)
    found = []
    for stamp in range(0, 300_000_000, 7_000_000):
        found += pieces.step_to(stamp)
    found += pieces.step_to(300_000_000)
    assert repr(found) == repr(whole.step_to(300_000_000))


def test_instability_is_reported_in_one_line(make_robot: MakeRobot) -> None:
    simulation = Simulation(make_robot({"motor.resistance": 1e-4}))
    simulation.command(0.4, 0.0, 0.0)
    with pytest.raises(InputError, match="unstable"):
        simulation.step_to(3_000_000_000)


@pytest.mark.parametrize(
    ("rate", "stretch", "per_tick", "runs", "steps"),
    [
        (200.0, 0.005, 1, 1, 5),
        (1000.0, 0.005, 1, 5, 1),
        (50.0, 0.005, 4, 1, 5),
        (32.0, 1 / 32 / 7, 7, 1, 5),
        (300.0, 1 / 300, 1, 1, 4),
        (10_000.0, 0.005, 1, 50, 1),
    ],
)
def test_time_step_divides_the_control_period(
    rate: float, stretch: float, per_tick: int, runs: int, steps: int
) -> None:
    grid = TimeGrid.of(rate)
    assert grid.stretch == pytest.approx(stretch)
    assert (grid.stretches_per_tick, grid.runs, grid.steps) == (per_tick, runs, steps)
    assert grid.timestep <= 0.001 + 1e-12
    steps_per_period = grid.control_period / grid.timestep
    assert steps_per_period == pytest.approx(round(steps_per_period))


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_slow_and_fast_drivers_reach_the_same_speed(
    rate: float, make_robot: MakeRobot, drive: Callable
) -> None:
    changes = {"controller.rate": rate, "controller.proportional": 0.6}
    run = drive(Simulation(make_robot(changes, ideal=True)), 5.0, (0.0, 0.3, 0.0), skip=4.0)
    assert run.joints().mean(axis=0) == pytest.approx([-6.0, 3.0, 3.0], abs=0.012)


def test_what_mujoco_refuses_is_reported_in_one_line(make_robot: MakeRobot) -> None:
    with pytest.raises(InputError, match=r"cannot be simulated \(.*\): check its masses and radii"):
        Simulation(make_robot({"robot.robot_radius": 0.001}))
