"""A robot that is lifted feels its weight change: at once, at any rate, by an accelerometer."""

import math
from collections.abc import Callable

import pytest
from odometry_drives import ROBOT, START

from tomr_odometry.estimator import SlipOdometry


def carried(weight: Callable[[float], float], rate: float = 100.0, length: float = 4.0) -> bool:
    """Whether a robot that stands is ever taken to be lifted, by its weight over time [m/s^2]."""
    core, found = SlipOdometry(ROBOT), False
    for sample in range(round(length * rate)):
        stamp = START + round(1e9 * sample / rate)
        core.encoders(stamp, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        core.imu(stamp + 1_000_000, (0.0, 0.0, 0.0, 0.0, 0.0, weight(sample / rate)))
        found |= any(item.is_carried for item in core.due())
    return found


@pytest.mark.parametrize("rate", [100.0, 25.0])
def test_a_weight_that_changes_within_moments_is_a_lift_and_a_drift_is_none(rate: float) -> None:
    assert carried(lambda t: 9.81 + min(max(15.0 * (t - 1.0), 0.0), 3.0), rate)
    assert not carried(lambda t: 9.81 + min(max(2.0 * (t - 1.0), 0.0), 4.0), rate)


def test_a_sample_without_a_weight_is_left_out() -> None:
    assert carried(lambda t: math.nan if 0.5 < t < 1.0 else 9.81 if t < 1.0 else 13.0, length=1.5)


def test_what_feels_no_gravity_says_nothing_of_a_weight() -> None:
    assert not carried(lambda t: 3.0 * math.sin(20.0 * t), length=2.0)


def test_a_bump_and_wheels_that_chatter_are_no_lift() -> None:
    """Samples of up to 5 m/s^2 off are what contacts do that grip and slip in turn."""
    chatter = [4.0, -3.5, 2.0, -5.0, 3.0, -0.5]
    assert not carried(lambda t: 9.81 + chatter[round(100 * t) % 6] * (1.0 < t < 2.0))
    assert not carried(lambda t: 9.81 + 4.0 * (1.0 < t < 1.015))
    assert carried(lambda t: 9.81 + 2.0 * (1.0 < t < 1.3))
