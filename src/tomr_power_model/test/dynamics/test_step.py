"""One period of the drivers: numbers worked by hand.

The reference robot: k = 0.7 N m/A at the wheel, R = 0.8 ohm, J = 6e-4 + 20^2 * 5e-6 = 2.6e-3
kg m^2, r = 0.05 m, wheels at 0, 120, 240 degrees at 0.2 m; 1.2 V s/rad and 12 V/rad at 200 Hz.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.step import COPPER
from tomr_power_model.dynamics.vehicle import Vehicle
from tomr_power_model.robot import GRAVITY, Supply

MakeVehicle = Callable[..., Vehicle]
DriveVehicle = Callable[..., Any]

K, R = 0.7, 0.8
SPIN_INERTIA = 2.6e-3 + 0.35 * 0.05**2 / (3.0 * 0.2**2)  # of a wheel in a spin [kg m^2]
NO_LOOP = {"proportional": 0.0, "integral": 0.0}
AT_ONCE = {"acceleration_limit": 0.0}


def held(twist: tuple[float, float, float], periods: int) -> np.ndarray:
    return np.tile(twist, (periods, 1))


def holding(vehicle: Vehicle, volts: float) -> list[float]:
    """A state at rest whose drivers' integrals hold a voltage."""
    state = Simulation(vehicle).start()
    for wheel in range(vehicle.count):
        place = at.STATE_HEADER + wheel * at.STATE_WHEEL
        state[place + at.INTEGRAL] = volts / vehicle.controller.integral
        state[place + at.HELD] = K / R * volts
    return state


def test_steady_power(make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle) -> None:
    # Along +x at 0.4 m/s wheel 2 turns at 0.4 * 0.866 / 0.05 = 6.9282 rad/s against 0.06 +
    # 0.004 * 6.9282 = 0.087713 N m; standby 1.2 W.
    steps = drive_vehicle(make_vehicle(), held((0.4, 0.0, 0.0), 800)).steps
    current = 0.087713 / K
    power = current * (R * current + K * 6.9282) + 1.2
    np.testing.assert_allclose(steps.speed[-1], [0.0, 6.9282, -6.9282], atol=1e-4)
    np.testing.assert_allclose(steps.power[-1], [1.2, power, power], rtol=1e-4)
    np.testing.assert_allclose(steps.copper[-1, 1], R * current**2, rtol=1e-4)


def test_a_spin_starts_with_the_motor_time_constant(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # At its first period the driver sees no speed: V = kp e, e = -4 * 1 rad/s, and the wheel
    # approaches V / k with T = J R / k^2; the current is the mean of (V - k omega) / R.
    spinning = make_vehicle(physics={}, integral=0.0, **AT_ONCE)
    driven = drive_vehicle(spinning, held((0.0, 0.0, 1.0), 1))
    volts, constant = -4.8, SPIN_INERTIA * R / K**2
    speed = volts / K * (1.0 - math.exp(-0.005 / constant))
    assert driven.wheels[0, :, at.SPEED] == pytest.approx([speed] * 3, rel=1e-9)
    assert driven.twist[0] == pytest.approx([0.0, 0.0, speed / -4.0], abs=1e-9)
    assert driven.steps.current[0, 0] == pytest.approx((volts - 0.5 * K * speed) / R)


def test_short_circuited_motors_brake_and_open_ones_coast(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    idle = make_vehicle(physics={}, **NO_LOOP)
    rest = held((0.0, 0.0, 0.0), 20)
    shorted = drive_vehicle(idle, rest, Simulation(idle).start((0.0, 0.0, 2.0)))
    decay = math.exp(-0.1 * K**2 / (R * SPIN_INERTIA))
    assert shorted.twist[-1, 2] == pytest.approx(2.0 * decay, rel=1e-9)
    assert shorted.steps.power == pytest.approx(np.zeros((20, 3)))  # all of it warms the windings
    opened = drive_vehicle(idle, rest, Simulation(idle).start((0.0, 0.0, 2.0)), {at.CONNECTED: 0.0})
    # The back-EMF is given back at the start of each step: second order in 5 ms.
    assert opened.twist[-1, 2] == pytest.approx(2.0, rel=2e-3)
    assert not opened.steps.current.any()


def test_a_stopped_wheel_is_held_by_its_drivers_integral(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # 0.43 N m hold up to 0.43 R / k = 0.491 V. Asked for -0.1 rad/s, 40 periods add up to
    # 0.02 rad, 12 * 0.02 = 0.24 V; commanded to stop, that stays and draws 0.24^2 / 0.8 = 0.072 W.
    sticky = make_vehicle(physics={"friction.coulomb": {"torque": 0.43}}, **AT_ONCE)
    commands = np.concatenate([held((0.0, 0.0, 0.025), 40), held((0.0, 0.0, 0.0), 200)])
    steps = drive_vehicle(sticky, commands).steps
    assert np.abs(steps.speed).max() < 2e-3  # the holding torques are found in a few steps
    assert np.abs(steps.speed[50:]).max() < 1e-9
    np.testing.assert_allclose(steps.power[50:], 0.072, rtol=1e-2)
    np.testing.assert_allclose(steps.current[50:], -0.3, rtol=5e-3)


def test_the_supply_sags_with_all_that_is_drawn(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # At rest 3 * 1.2 + 12 = 15.6 W: (24 - 0.5 I) I = 15.6.
    sagging = make_vehicle(further={"electrical.supply_sag": {"resistance": 0.5}})
    rest = drive_vehicle(sagging, held((0.0, 0.0, 0.0), 20)).steps
    current = 24.0 - math.sqrt(576.0 - 2.0 * 15.6)
    assert rest.voltage[-1] == pytest.approx(24.0 - 0.5 * current, rel=1e-9)
    # Asked for far too much, a robot without friction reaches bus / k; on the way it asks for more
    # than there is, and the bus breaks down to a half.
    free = make_vehicle(physics={"electrical.supply_sag": {"resistance": 0.5}}, **AT_ONCE)
    fast = drive_vehicle(free, held((0.0, 0.0, 50.0), 400)).steps
    assert fast.voltage.min() > 12.0 - 1e-9
    assert fast.voltage[-1] == pytest.approx(24.0 - 0.5 * 12.0 / fast.voltage[-1])
    assert fast.speed[-1] == pytest.approx([-fast.voltage[-1] / K] * 3, rel=1e-3)


def test_a_part_of_braking_power_returns(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    stop = np.concatenate([held((1.2, 0.0, 0.0), 200), held((0.0, 0.0, 0.0), 60)])
    bare, lossy = (
        drive_vehicle(make_vehicle(physics=physics), stop).steps
        for physics in ({}, {"electrical.regeneration_loss": {"efficiency": 0.4}})
    )
    np.testing.assert_allclose(lossy.speed, bare.speed, atol=1e-12)
    returned = bare.power + 0.5 * np.abs(bare.tilt) < 0.0  # throughout the step
    assert bare.power.min() < -10.0
    np.testing.assert_allclose(lossy.power[returned], 0.4 * bare.power[returned])
    drawn = bare.power - 0.5 * np.abs(bare.tilt) > 0.0
    np.testing.assert_allclose(lossy.power[drawn], bare.power[drawn])


def test_windings_warm_up_by_their_time_constant(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # 1.6 V on a wheel that sticks: 2 A, 3.2 W. At 0.01 K/W it settles at 0.032 K.
    def heating(resistance: float) -> dict[str, dict[str, float]]:
        warm = {"thermal_resistance": resistance, "time_constant": 0.5, "initial": 0.0}
        return {"friction.coulomb": {"torque": 5.0}, "electrical.winding_heating": warm}

    mild = make_vehicle(physics=heating(0.01))
    rest = held((0.0, 0.0, 0.0), 1000)
    rise = drive_vehicle(mild, rest, holding(mild, 1.6)).wheels[:, 0, at.RISE]
    time = 0.005 * np.arange(1, 1001)
    np.testing.assert_allclose(rise, 0.032 * (1.0 - np.exp(-time / 0.5)), rtol=2e-4)
    # At 20 K/W resistance grows with it: T = 20 V^2 / R(T), here 52.97 K.
    hot = make_vehicle(physics=heating(20.0))
    settled = drive_vehicle(hot, rest, holding(hot, 1.6))
    rise = settled.wheels[-1, 0, at.RISE]
    assert rise == pytest.approx(20.0 * 1.6**2 / (R * (1.0 + COPPER * rise)), rel=1e-3)
    assert rise == pytest.approx(52.97, abs=0.03)
    assert settled.steps.current[-1, 0] == pytest.approx(1.6 / R / (1.0 + COPPER * rise), rel=1e-3)


def test_dry_friction_holds_on_a_slope_until_it_is_too_steep(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # Two wheels hold 2 * 0.866 / 0.05 * 0.06 = 2.0785 N along x, all of m g sin(0.014131).
    dry = 2.0 * math.sqrt(0.75) / 0.05 * 0.06

    def on(angle: float) -> Any:
        slope = {"angle": angle, "azimuth": 0.0}
        physics = {"friction.coulomb": {"torque": 0.06}, "body.slope": slope}
        return drive_vehicle(make_vehicle(physics=physics, **NO_LOOP), held((0.0,) * 3, 400))

    flat = on(0.01410).twist
    assert np.abs(flat).max() < 1e-4  # m/s, while the holding torques are found
    assert np.abs(flat[50:]).max() < 1e-9
    # Steeper, it rolls down at what is left over 2 * 0.75 / 0.05^2 * k^2 / R.
    pull = 15.0 * GRAVITY * math.sin(0.02)
    expected = (pull - dry) / (2.0 * 0.75 / 0.05**2 * K**2 / R)
    assert on(0.02).twist[-1] == pytest.approx([expected, 0.0, 0.0], rel=1e-6, abs=1e-8)


def test_a_slope_turns_a_robot_by_its_mass_centre(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # 3 cm to the left of the middle: -0.03 m g sin(0.02) against 3 (0.2 / 0.05)^2 k^2 / R.
    slope = {"body.slope": {"angle": 0.02, "azimuth": 0.0}}
    vehicle = make_vehicle(physics=slope, mass_center=(0.0, 0.03, 0.0), **NO_LOOP)
    turning = -0.03 * 15.0 * GRAVITY * math.sin(0.02) / (3.0 * 4.0**2 * K**2 / R)
    assert drive_vehicle(vehicle, held((0.0,) * 3, 200)).twist[-1, 2] == pytest.approx(
        turning, rel=1e-3
    )


def test_in_saturation_the_integral_does_not_wind_up(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    free = make_vehicle(physics={}, **AT_ONCE)
    driven = drive_vehicle(
        free, np.concatenate([held((0.0, 0.0, 50.0), 600), held((0.0, 0.0, 0.0), 100)])
    )
    assert driven.steps.speed[599, 0] == pytest.approx(-24.0 / K, rel=1e-6)
    assert np.ptp(driven.wheels[100:600, 0, at.INTEGRAL]) == 0.0
    assert np.abs(driven.wheels[:, :, at.VOLTS]).max() == 24.0
    # It brakes at once, and passes zero by no more than the loop's own overshoot.
    assert driven.steps.speed[603, 0] > -12.0
    assert driven.steps.speed[600:].max() < 0.15 * 24.0 / K


@pytest.mark.parametrize(("integrator", "first"), [("backward", 0.005), ("forward", 0.0)])
def test_the_integral_holds_the_present_error_or_not(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, integrator: str, first: float
) -> None:
    vehicle = make_vehicle(integrator=integrator, **AT_ONCE)
    driven = drive_vehicle(vehicle, held((0.0, 0.0, 0.5), 2))
    volts = driven.wheels[:, 0, at.VOLTS]
    assert volts[0] == pytest.approx(-2.0 * (1.2 + 12.0 * first))
    seen = -2.0 - driven.wheels[0, 0, at.MEASURED]
    summed = -2.0 * 0.005 + seen * first
    assert volts[1] == pytest.approx(1.2 * seen + 12.0 * summed)


def test_set_points_are_ramped(make_vehicle: MakeVehicle) -> None:
    # 2 m/s^2 along the command, 2 / 0.2 = 10 rad/s^2 in yaw.
    simulation = Simulation(make_vehicle())
    state, asked = simulation.start(), simulation.inputs()
    asked[at.COMMAND : at.COMMAND + 3] = [0.3, -0.4, 0.07]
    found = []
    for _ in range(60):
        simulation.advance(state, asked)
        found.append(state[at.SET : at.SET + 3])
    np.testing.assert_allclose(found[0], [0.006, -0.008, 0.05])
    np.testing.assert_allclose(found[9], [0.06, -0.08, 0.07])
    np.testing.assert_allclose(found[-1], [0.3, -0.4, 0.07])


def test_an_encoder_loses_no_counts(make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle) -> None:
    quantum = 2.0 * math.pi / 500
    coarse = make_vehicle(encoder_quantum=quantum)
    driven = drive_vehicle(coarse, held((0.1, 0.05, 0.3), 400))
    counts = driven.wheels[:, :, at.MEASURED] * 0.005 / quantum
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    counted = quantum * counts.sum(axis=0)
    assert np.abs(counted - driven.wheels[-1, :, at.ANGLE]).max() <= 0.5 * quantum + 1e-9
    # The loop still holds the speed on average.
    wanted = drive_vehicle(make_vehicle(), held((0.1, 0.05, 0.3), 400)).steps.speed[200:]
    np.testing.assert_allclose(
        driven.steps.speed[200:].mean(axis=0), wanted.mean(axis=0), atol=0.02
    )


def test_drivers_just_too_fast_for_steps_are_taken_as_continuous(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    def speed(rate: float, periods: int, every: int) -> np.ndarray:
        vehicle = make_vehicle(rate=rate)
        found = drive_vehicle(vehicle, held((0.3, 0.1, 0.5), periods)).wheels[:, :, at.SPEED]
        return np.asarray(found[every - 1 :: every])

    stepped, continuous = speed(500.0, 500, 5), speed(501.0, 200, 2)
    assert np.abs(stepped).max() > 5.0
    assert np.abs(continuous - stepped).max() < 0.25  # of 6 rad/s: while it speeds up
    np.testing.assert_allclose(continuous[-1], stepped[-1], atol=5e-3)


def test_a_robot_without_supply_stands_still(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    dead = make_vehicle(supply=Supply(1e-6, 0.0))
    assert np.abs(drive_vehicle(dead, held((0.5, 0.0, 0.0), 50)).twist).max() < 1e-8
