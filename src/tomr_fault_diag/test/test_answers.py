"""Whether wheels turn as fast as the description has them, tick by tick."""

import math

import pytest

from tomr_fault_diag.residuals.answers import AnswerWatch
from tomr_fault_diag.residuals.frame import Residual
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
# 3 s each: straight ahead, aside, turning on the spot, standing.
LEGS = ((0.3, 0.0, 0.0), (0.0, -0.4, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def _take(watch: AnswerWatch, seconds: float, ratio: float, period: float = 0.05) -> None:
    """Wheels that turn `ratio` times as fast as modelled."""
    for number in range(1, round(seconds / period) + 1):
        asked = twist_to_wheels(ROBOT) @ LEGS[int(number * period // 3.0) % 4]
        speeds = [Residual((ratio - 1.0) * abs(speed), 0.1, speed, "rad/s") for speed in asked]
        watch.take(to_ns(number * period), speeds)


@pytest.mark.parametrize("period", [0.01, 0.05, 0.2])
def test_a_wrong_radius_is_said_once_it_is_sure_and_no_more_once_it_is_mended(
    period: float,
) -> None:
    watch = AnswerWatch(ROBOT, to_ns(period))
    _take(watch, 3.0, 1.08, period)
    assert watch.remark().level is Level.OK  # under three seconds of steady motion
    _take(watch, 48.0, 1.08, period)
    remark = watch.remark()
    assert remark.level is Level.WARN
    assert remark.topic == "robot.yaml"
    assert "they turn 1.080 times as fast as described" in remark.message
    assert "write robot.wheel_radius: 0.0463" in remark.message  # 0.05 m / 1.08
    assert watch.words() == remark.message
    _take(watch, 250.0, 1.0, period)  # two minutes of driving
    assert watch.remark().message == "nothing speaks against it"


def test_a_robot_that_stands_forgets_nothing() -> None:
    watch = AnswerWatch(ROBOT, to_ns(0.05))
    _take(watch, 48.0, 0.9)
    said = watch.remark()
    still = [Residual(0.0, 0.1, 0.0, "rad/s")] * 3
    for number in range(6000):  # five minutes
        watch.take(to_ns(48.0 + 0.05 * number), still)
    assert said.level is Level.WARN
    assert watch.remark() == said


def test_what_is_not_known_says_nothing() -> None:
    watch = AnswerWatch(ROBOT, to_ns(0.05))
    assert watch.words() == ""
    unknown = [Residual(math.nan, 0.1, 5.0, "rad/s")] * 3
    unpredicted = [Residual(math.nan, math.nan, math.nan, "rad/s")] * 3
    for number in range(1, 1000):
        watch.take(to_ns(0.05 * number), (unknown, unpredicted)[number % 2])
    assert watch.words() == ""
    assert watch.remark().level is Level.OK
