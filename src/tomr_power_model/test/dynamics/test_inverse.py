"""Inverse dynamics: torques and powers worked by hand, and the same as the simulation's."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.step import COPPER
from tomr_power_model.dynamics.vehicle import Vehicle
from tomr_power_model.robot import GRAVITY

MakeVehicle = Callable[..., Vehicle]
DriveVehicle = Callable[..., Any]
KINDS = ("three_omni", "four_omni", "four_mecanum", "two_driven")


def powers(
    vehicle: Vehicle,
    twist: tuple[float, float, float],
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0),
    heading: float = math.nan,
    rise: float = 0.0,
    yaw: float = math.nan,
    held: float = math.nan,
) -> np.ndarray:
    """Torque, current, voltage and power of each wheel, (n, 4), from a body's motion.

    `yaw` is a gyro's [rad/s], `held` the voltage of the drivers.
    """
    p, n = laid_out(vehicle), vehicle.count
    width = (len(p) - at.HEADER - 5 * n * n) // n
    roll = p[at.HEADER : at.HEADER + n * width].reshape(n, width)[:, at.ROLL : at.ROLL + 3]
    motion = np.zeros(at.MOTION_HEADER + n * at.MOTION_WHEEL)
    motion[at.MOTION_YAW], motion[at.MOTION_HEADING] = yaw, heading
    wheels = motion[at.MOTION_HEADER :].reshape(n, at.MOTION_WHEEL)
    wheels[:, at.MOTION_SPEED], wheels[:, at.MOTION_ACCELERATION] = roll @ twist, roll @ rate
    wheels[:, at.MOTION_RISE], wheels[:, at.MOTION_VOLTAGE] = rise, held
    found = np.zeros((1, n * at.POWER_WHEEL))
    laws = plain(tuple(vehicle.physics))
    laws.drive_powers(p, motion[None], found, n)
    each = np.zeros(n * at.POWER_WHEEL)
    for wheel in range(n):
        laws.one_drive_power(p, motion, each, n, wheel)
        done = (wheel + 1) * at.POWER_WHEEL
        np.testing.assert_array_equal(each[:done], found[0, :done])
        assert not each[done:].any()
    return found.reshape(n, at.POWER_WHEEL)


def test_accelerating_torques(make_vehicle: MakeVehicle) -> None:
    # 1 m/s^2 along +x: K^-T (m a, 0, 0) + J omega', m a r / sqrt(3) at wheels 2 and 3.
    torque = powers(make_vehicle(physics={}), (0.0,) * 3, (1.0, 0.0, 0.0))[:, at.POWER_TORQUE]
    wheel = 15.0 * 0.05 / math.sqrt(3.0) + 2.6e-3 * math.sqrt(0.75) / 0.05
    np.testing.assert_allclose(torque, [0.0, wheel, -wheel], atol=1e-12)


@pytest.mark.parametrize(("kind", "share"), [("four_mecanum", 0.25), ("two_driven", 0.5)])
def test_accelerating_torques_on_other_wheels(
    make_vehicle: MakeVehicle, kind: str, share: float
) -> None:
    # All wheels drive along +x: each takes its share of m a r, and J a / r.
    torque = powers(make_vehicle(kind, physics={}), (0.0,) * 3, (1.0, 0.0, 0.0))[:, at.POWER_TORQUE]
    np.testing.assert_allclose(torque, share * 15.0 * 0.05 + 2.6e-3 / 0.05)


@pytest.mark.parametrize(("wheels_yaw", "gyro"), [(1.0, math.nan), (0.0, 1.0)])
def test_turning_while_driving_needs_the_side_force(
    make_vehicle: MakeVehicle, wheels_yaw: float, gyro: float
) -> None:
    # In the body frame a robot that drives along x and yaws feels m omega v sideways: the wheels
    # push with F_y = 7.5 N, r F_y (-2/3, 1/3, 1/3). A gyro knows the yaw better than the wheels.
    found = powers(make_vehicle(physics={}), (0.5, 0.0, wheels_yaw), yaw=gyro)
    torque = found[:, at.POWER_TORQUE]
    np.testing.assert_allclose(torque, 0.05 * 7.5 * np.array([-2.0, 1.0, 1.0]) / 3.0, atol=1e-12)


def test_friction_follows_the_load_that_acceleration_moves(make_vehicle: MakeVehicle) -> None:
    # 1 m/s^2 along +x takes 2/3 m h a / R = 6 N off wheel 1 and leans half of it on each other.
    flat = {"mass_center": (0.0, 0.0, 0.12)}
    resisted = make_vehicle(physics={"contact.rolling_resistance": {"coefficient": 0.02}}, **flat)
    torque, free = (
        powers(vehicle, (0.5, 0.5, 0.0), (1.0, 0.0, 0.0))[:, at.POWER_TORQUE]
        for vehicle in (resisted, make_vehicle(physics={}, **flat))
    )
    load = 5.0 * GRAVITY + np.array([-6.0, 3.0, 3.0])
    np.testing.assert_allclose(torque - free, 0.02 * 0.05 * load * [-1.0, 1.0, -1.0], rtol=1e-6)


@pytest.mark.parametrize(
    ("volts", "torque"),
    [(0.24, 0.21), (-0.24, -0.21), (0.6, 0.43), (0.7, 0.0), (math.nan, 0.0)],
)
def test_a_resting_wheel_holds_what_its_driver_asks_for(
    make_vehicle: MakeVehicle, volts: float, torque: float
) -> None:
    """k / R V up to dry friction; a driver that asks for more than 1.3 times it is not obeyed."""
    sticky = make_vehicle(physics={"friction.coulomb": {"torque": 0.43}})
    found = powers(sticky, (0.0, 0.0, 0.0), held=volts)
    np.testing.assert_allclose(found[:, at.POWER_TORQUE], torque)
    np.testing.assert_allclose(found[:, at.POWER_DRAWN], 0.8 * (torque / 0.7) ** 2)
    assert found[:, at.POWER_OBEYED].tolist() == [0.0 if volts == 0.7 else 1.0] * 3


def test_a_slope_is_carried_where_the_heading_is_known(make_vehicle: MakeVehicle) -> None:
    slope = {"body.slope": {"angle": 0.1, "azimuth": 0.0}}
    vehicle = make_vehicle(physics=slope)
    pull = 15.0 * GRAVITY * math.sin(0.1)
    downhill = powers(vehicle, (0.0,) * 3, heading=0.0)[:, at.POWER_TORQUE]
    wheel = -pull * 0.05 / math.sqrt(3.0)
    np.testing.assert_allclose(downhill, [0.0, wheel, -wheel], atol=1e-12)
    back = powers(vehicle, (0.0,) * 3, heading=math.pi)[:, at.POWER_TORQUE]
    np.testing.assert_allclose(back, -downhill, atol=1e-12)
    assert not powers(vehicle, (0.0,) * 3)[:, at.POWER_TORQUE].any()
    # It pulls at the mass centre: 3 cm to the left the robot would turn by -y F_x.
    beside = make_vehicle(physics=slope, mass_center=(0.0, 0.03, 0.0))
    turning = powers(beside, (0.0,) * 3, heading=0.0)[:, at.POWER_TORQUE] - downhill
    np.testing.assert_allclose(turning, -0.03 * pull * 0.05 / (3.0 * 0.2), atol=1e-12)


def test_warm_windings_take_more_voltage_for_the_same_current(make_vehicle: MakeVehicle) -> None:
    cold, warm = (powers(make_vehicle(), (0.4, 0.0, 0.0), rise=rise) for rise in (0.0, 50.0))
    np.testing.assert_allclose(warm[:, at.POWER_CURRENT], cold[:, at.POWER_CURRENT])
    more = 0.8 * COPPER * 50.0 * cold[:, at.POWER_CURRENT]
    np.testing.assert_allclose(warm[:, at.POWER_VOLTAGE] - cold[:, at.POWER_VOLTAGE], more)


@pytest.mark.parametrize("kind", KINDS)
def test_a_steady_drive_takes_what_the_simulation_takes(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    further = {
        "friction.stribeck": {"torque": 0.02, "speed": 3.0},
        "friction.asymmetric": {"torque": 0.01},
        "friction.load_dependent": {"coefficient": 0.1},
        "friction.quadratic": {"coefficient": 2e-4},
        "contact.rolling_resistance": {"coefficient": 0.01},
        "contact.roller_drag": {"coefficient": 0.05, "slip": 0.5},
        "body.payload_mass": {"mass": 5.0},
        "electrical.switching_loss": {"coefficient": 0.3},
        "electrical.iron_loss": {"hysteresis": 1e-4, "eddy": 1e-6},
    }
    vehicle = make_vehicle(kind, further=further)
    twist = (0.5, 0.0, 0.4)
    steps = drive_vehicle(vehicle, np.tile(twist, (1500, 1))).steps
    found = powers(vehicle, twist)
    # How wheels share their load is open where there are four: then the whole is compared.
    if vehicle.count == 4:
        assert found[:, at.POWER_DRAWN].sum() == pytest.approx(steps.power[-1].sum(), rel=0.01)
    else:
        np.testing.assert_allclose(found[:, at.POWER_DRAWN], steps.power[-1], rtol=0.01)
