"""Wheel speeds by encoders that come more rarely than ticks."""

import math

import numpy as np
import pytest

from tomr_fault_diag.residuals.slow_encoders import ExpectedMotion
from tomr_power_model.messages.intake import Triple
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow, WheelEstimate
from tomr_power_model.model.ticks import to_ns

PERIOD = to_ns(0.05)
START = 20_000 * PERIOD
UNKNOWN = (math.nan,) * 3
SPEED = 6.0  # rad/s


def angle(time: float) -> float:
    """A wheel that stops every other second, within a fifth of it, and sets off again [rad]."""
    return 4.0 * SPEED / math.pi * math.sin(0.25 * math.pi * time) + 0.3 * math.sin(9.0 * time)


def mean_speed(tick: int) -> float:
    """In the tick that ends so many periods after the start [rad/s]."""
    return (angle(0.05 * tick) - angle(0.05 * (tick - 1))) / 0.05


def driven(
    interval: float, turned: float = 1.0, lacking: range = range(0)
) -> list[tuple[float, WheelEstimate, WheelEstimate]]:
    """Four seconds of a wheel that turns so many times as far as expected: speeds as expected, as
    estimated, and as encoders alone show them; in some ticks nothing is expected."""
    motion, found = ExpectedMotion(PERIOD), []
    window = EncoderWindow(to_ns(0.07), PERIOD, to_ns(0.5))
    next_sample = 0
    for tick in range(1, 80):
        while next_sample * interval <= 0.05 * tick:
            there = turned * angle(next_sample * interval)
            stamp = START + to_ns(next_sample * interval)
            window.add(EncoderSample(stamp, (there, there, there), UNKNOWN))
            next_sample += 1
        speed = mean_speed(tick)
        asked: Triple = UNKNOWN if tick in lacking else (speed, speed, speed)
        stamp = START + tick * PERIOD
        found.append((speed, motion.estimate(stamp, asked, window), window.at(stamp)))
    return found[20:]


@pytest.mark.parametrize("interval", [0.045, 0.07, 0.1])
def test_wheels_that_turn_as_expected_are_measured_so(interval: float) -> None:
    found = driven(interval)
    off = [abs(estimate.speed - speed).max() for speed, estimate, _ in found]
    alone = [abs(estimate.speed - speed).max() for speed, _, estimate in found]
    assert max(off) < 0.1  # the band of a speed
    assert max(alone) > 0.3


@pytest.mark.parametrize(("turned", "share"), [(0.0, 0.4), (0.8, 0.08), (1.2, 0.08)])
def test_wheels_that_turn_otherwise_are_measured_so(turned: float, share: float) -> None:
    """The worse, the faster what is expected changes."""
    found = driven(0.1, turned)
    off = [estimate.speed[0] - turned * speed for speed, estimate, _ in found]
    level = [speed for speed, *_ in found]
    assert np.sqrt(np.mean(np.square(off))) < share * np.sqrt(np.mean(np.square(level)))


def test_encoders_that_come_often_show_it_alone() -> None:
    for _, estimate, alone in driven(0.02):
        assert np.array_equal(estimate.speed, alone.speed)
        assert estimate.gain == alone.gain


def test_what_was_not_expected_long_enough_is_measured_alone() -> None:
    found = driven(0.1, lacking=range(40, 42))
    alike = [np.array_equal(one.speed, alone.speed) for _, one, alone in found]
    first = 40 - 21
    assert all(alike[first : first + 4])
    assert not any(alike[:first])
    assert not any(alike[first + 8 :])
