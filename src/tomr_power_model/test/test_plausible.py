"""What no sensor of the reference robot (24 V, 0.8 ohm, 0.7 V s/rad, 12 W besides) can measure."""

import math

import pytest
from attrs import evolve

from tomr_power_model.drive.plausible import PowerLimits, fastest_wheel
from tomr_power_model.drive.sources import TOTAL, PowerReading
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
NAN = math.nan


@pytest.mark.parametrize(
    ("wheel", "power", "current", "voltage", "said"),
    [
        (0, 700.0, 29.0, 24.0, ""),
        (0, -700.0, -29.0, 24.0, ""),
        (1, 24e30, 1.0, 1e30, "more V of motor 2 than can be (48 V"),
        (1, 24e3, 1.0, 24e3, "(48 V is twice what it can, is it in mV?)"),
        (1, 24.0 * 800.0, 800.0, NAN, "(60 A is twice what it can, is it in mA?)"),
        (1, 1e9, 1e8, NAN, "(60 A is twice what it can)"),
        (2, 1.0, 61.0, NAN, "more A of motor 3 than can be (60 A is twice what it can)"),
        (2, 1441.0, NAN, NAN, "more W of motor 3 than can be (1.44e+03 W"),
        (TOTAL, 4000.0, 170.0, 24.0, ""),
        (TOTAL, 4400.0, 170.0, 24.0, "of the robot than can be"),
        (0, 0.0, 0.0, 0.0, "V feed nothing of motor 1"),
        (0, NAN, 0.3, NAN, ""),
    ],
)
def test_a_margin_of_two(
    wheel: int, power: float, current: float, voltage: float, said: str
) -> None:
    found = PowerLimits.of(ROBOT).problem(PowerReading(wheel, 1, power, current, voltage))
    assert said in found if found is not None else not said


def test_where_currents_are_compared_a_voltage_may_be_left_at_zero() -> None:
    robot = evolve(ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current"))
    reading = PowerReading(0, 1, NAN, 100.0, 0.0)  # reversed at speed
    assert PowerLimits.of(robot).problem(reading) is None


def test_no_wheel_turns_faster_than_its_motor_without_load() -> None:
    assert fastest_wheel(ROBOT) == pytest.approx(2.0 * 24.0 / 0.7)
