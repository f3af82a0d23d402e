"""An IMU that says nothing of its robot."""

import math

import numpy as np
import pytest

from tomr_odometry.stuck import StuckImu
from tomr_power_model.messages.intake import Triple

MS = 1_000_000
SPEED = np.array([0.2, -0.1, -0.1])  # m/s, of the rims


def watch() -> StuckImu:
    return StuckImu(np.eye(3))


def test_one_that_reads_zero_says_nothing() -> None:
    assert watch().take(MS, (0.0,) * 6)
    assert not watch().take(MS, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    assert not watch().take(MS, (math.nan, math.nan, 0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("force", [(0.0, 0.0, 9.8), (math.nan,) * 3], ids=["", "gyro alone"])
def test_one_that_repeats_itself_does_once_the_wheels_twist_has_changed(force: Triple) -> None:
    imu = watch()
    found = []
    for at in range(0, 1000, 10):
        values = [0.0 + value for value in force]  # NaN, but never the same
        said = imu.take(at * MS, (0.0, 0.0, 0.1, *values))
        now = imu.look(at * MS, SPEED * (1.0 + 0.002 * at))
        found.append((at, said, now))
    at = next(at for at, _, now in found if now)
    assert 150 < at < 500  # 0.1 m/s more
    assert [said for time, said, _ in found] == [time > at for time, *_ in found]


def test_one_that_goes_on_is_believed_again() -> None:
    imu = watch()
    for at in range(0, 1000, 10):
        imu.take(at * MS, (0.0, 0.0, 0.1, 0.0, 0.0, 9.8))
        imu.look(at * MS, SPEED * (1.0 + 0.002 * at))
    imu.take(1000 * MS, (0.0, 0.0, 0.2, 0.0, 0.0, 9.8))
    imu.look(1000 * MS, SPEED)
    assert not imu.take(1010 * MS, (0.0, 0.0, 0.3, 0.0, 0.0, 9.8))
