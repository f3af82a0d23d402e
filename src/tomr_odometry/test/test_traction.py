"""Forces of contacts from power: what inverse dynamics make of a motion is found again."""

import math

import pytest

from tomr_odometry.traction import Tractions
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
WHEELS = 3


def _motion(speed: float, change: float) -> list[float]:
    wheel = [speed, change, 0.0, 0.0, 0.0, math.nan]
    return [math.nan, math.nan, *wheel, *wheel, *wheel]


@pytest.mark.parametrize(
    ("speed", "change"), [(6.0, 0.0), (6.0, 12.0), (-3.0, -20.0), (8.0, -30.0)]
)
def test_one_of_two_currents_is_that_of_inverse_dynamics(speed: float, change: float) -> None:
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    motion, power, both = _motion(speed, change), [0.0] * 12, [0.0] * 6
    laws.drive_power(numbers, motion, power, WHEELS)
    drawn = power[at.POWER_DRAWN :: at.POWER_WHEEL]
    laws.motor_currents(numbers, motion, drawn, both, WHEELS)
    current = power[at.POWER_CURRENT]
    assert min(abs(one - current) for one in both[:2]) < 1e-3
    assert both[0] <= both[1]


def test_force_of_a_contact_is_what_accelerates_the_body() -> None:
    # Turning on the spot: each of three wheels gives a third of I alpha / R.
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    motion, power, found = _motion(5.0, 10.0), [0.0] * 12, [0.0] * 6
    laws.drive_power(numbers, motion, power, WHEELS)
    laws.tractions(numbers, motion, power[at.POWER_CURRENT :: at.POWER_WHEEL], found, WHEELS)
    turning = -ROBOT.wheel_radius / ROBOT.robot_radius * 10.0
    assert found[0] == pytest.approx(
        -ROBOT.inertia_z * turning / ROBOT.robot_radius / 3.0, rel=0.01
    )
    assert found[1] < 0.01


def test_nothing_is_said_without_a_command_or_power() -> None:
    tractions = Tractions(ROBOT)
    for sample in range(20):
        tractions.encoders(10_000_000 * (sample + 1), (0.05 * sample,) * 3)
    assert tractions.power(200_000_000, 0, 5.0) is None
    tractions.command(200_000_000, (0.3, 0.0, 0.0))
    assert tractions.power(200_000_000, 0, math.nan) is None
    assert tractions.power(200_000_000, 0, 5.0) is not None
