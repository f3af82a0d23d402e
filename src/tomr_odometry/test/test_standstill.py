"""Whether an IMU feels the same for as long as the wheels stand."""

import math

import numpy as np
import pytest

from tomr_odometry.kernel import Noise
from tomr_odometry.standstill import Felt, Standstill

NOISE = Noise()


def felt(
    turning: float = 0.0, ahead: float = 0.0, left: float = 0.0, *, growing: int | None = None,
    noise: float = 0.0, seconds: float = 0.5,
) -> Felt | None:  # fmt: skip
    """After some time in which the IMU felt this, one of it growing from zero to twice as much."""
    random = np.random.default_rng(3)
    standstill = Standstill(0.3)
    for step in range(round(100 * seconds)):
        now = np.array([turning, ahead, left])
        if growing is not None:
            now[growing] *= 2.0 * step / (100 * seconds)
        now += (
            noise
            * np.array([NOISE.gyro, NOISE.accelerometer, NOISE.accelerometer])
            * (random.standard_normal(3))
        )
        standstill.take(0.01 * step, np.array([9.0, 9.0, *now, 9.81]))
    return standstill.felt(NOISE)


def test_what_stays_the_same_is_felt_on_average() -> None:
    found = felt(0.01, 0.3, -0.2)
    assert found is not None
    assert found.is_steady
    assert found.samples == 31
    assert found.mean == pytest.approx([0.01, 0.3, -0.2])


def test_noise_is_no_change() -> None:
    found = felt(0.01, 0.1, -0.1, noise=1.0)
    assert found is not None
    assert found.is_steady
    assert found.mean == pytest.approx([0.01, 0.1, -0.1], abs=0.03)


@pytest.mark.parametrize(
    ("place", "least"), [(0, NOISE.gyro), (1, NOISE.accelerometer), (2, NOISE.accelerometer)]
)
def test_what_changes_by_four_standard_deviations_is_a_motion(place: int, least: float) -> None:
    # Between the first and the last ten of 31 samples a growth of 1 in 0.5 s is 0.42.
    edge = 4.0 * least * math.sqrt(0.2) / 0.42 / 2.0
    for factor, is_steady in ((0.95, True), (1.05, False)):
        values = [0.0, 0.0, 0.0]
        values[place] = factor * edge
        found = felt(*values, growing=place)
        assert found is not None
        assert found.is_steady == is_steady


def test_too_little_is_nothing() -> None:
    assert felt(seconds=0.2) is None
    standstill = Standstill(0.3)
    for step, time in enumerate((0.0, 0.14, 0.28)):
        assert (standstill.felt(NOISE) is None) == (step < 3)
        standstill.take(time, np.zeros(6))
    assert standstill.felt(NOISE) is not None


def test_samples_without_values_are_left_out() -> None:
    standstill = Standstill(0.3)
    for step in range(40):
        inertial = np.array([0.0, 0.0, math.nan if step % 2 else 0.0, 0.0, 0.0, 9.81])
        standstill.take(0.01 * step, inertial)
    found = standstill.felt(NOISE)
    assert found is not None
    assert found.samples == 15
    standstill.clear()
    assert standstill.felt(NOISE) is None
