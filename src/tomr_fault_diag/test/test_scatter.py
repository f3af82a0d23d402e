"""Stamps that scatter: how far the samples lie off the motion that they show."""

import math
import random
from collections.abc import Callable

import numpy as np
import pytest

from tomr_fault_diag.residuals.scatter import ScatterWatch
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow, WheelEstimate

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NOTHING = (float("nan"),) * 3
SPEED = 8.0  # rad/s of the fastest wheel

Angle = Callable[[float], float]  # rad, at a time [s]


def _watched(times: list[int], angle: Angle) -> ScatterWatch:
    """Of samples every 10 ms that were taken at other times [ms], over 3 s."""
    window = EncoderWindow(100 * MS, 50 * MS, 200 * MS)
    watch = ScatterWatch(fastest=40.0)
    for number, time in enumerate(times):
        turned = angle(1e-3 * time)
        positions = (turned, -0.5 * turned, -0.5 * turned)
        window.add(EncoderSample(BASE + 10 * number * MS, positions, NOTHING))
        if number % 5 == 4:
            watch.take(window.at(BASE + 10 * number * MS))
    return watch


def _jittered(deviation: float) -> list[int]:
    dice = random.Random(3)
    return sorted(round(10 * number + dice.gauss(0.0, deviation)) for number in range(300))


def _shuffled(deviation: float) -> list[int]:
    dice = random.Random(3)
    return sorted(range(0, 3000, 10), key=lambda time: time + dice.gauss(0.0, deviation))


def test_true_stamps_do_not_scatter() -> None:
    watch = _watched(list(range(0, 3000, 10)), lambda time: SPEED * time)
    assert watch.seconds < 1e-9
    assert not watch.is_disorder


def test_samples_in_another_order_than_they_were_taken_in_are_disorder() -> None:
    assert _watched(_shuffled(200.0), lambda time: SPEED * time).is_disorder


def test_stamps_that_jitter_by_milliseconds_are_no_disorder() -> None:
    watch = _watched(_jittered(5.0), lambda time: SPEED * time)
    assert watch.seconds > 0.001
    assert not watch.is_disorder


def test_coarse_encoders_of_a_slow_robot_are_no_disorder() -> None:
    count = 0.15  # rad: 42 a turn
    watch = _watched(list(range(0, 3000, 10)), lambda time: count * round(2.0 * time / count))
    assert watch.seconds > 0.015  # as much as in disorder
    assert not watch.is_disorder


def test_a_speed_that_no_wheel_reaches_is_disorder_until_others_outweigh_it() -> None:
    watch = ScatterWatch(fastest=40.0)
    true = WheelEstimate(np.full(3, 8.0), np.zeros(3), scatter=0.001)
    watch.take(WheelEstimate(np.array([0.0, -41.0, 1.0]), np.zeros(3)))
    assert watch.is_disorder
    watch.take(true)
    watch.take(true)
    assert not watch.is_disorder


def test_slow_encoders_do_not_stay_in_disorder() -> None:
    """At 30 Hz a window holds three samples, whose scatter does not show."""
    watch = ScatterWatch(fastest=40.0)
    glitch = WheelEstimate(np.array([0.0, -41.0, 1.0]), np.zeros(3))
    watch.take(glitch)
    watch.take(WheelEstimate(np.zeros(3), np.zeros(3)))
    assert watch.is_disorder  # at rest nothing shows
    watch.take(WheelEstimate(np.full(3, 8.0), np.zeros(3)))
    assert not watch.is_disorder
    watch.take(WheelEstimate(np.full(3, 8.0), np.zeros(3)))
    watch.take(glitch)
    assert watch.is_disorder


def _noisy(angles: tuple[float, float, float], stamps: float = 0.0) -> ScatterWatch:
    """Wheels at 8, -4 and -4 rad/s whose angles scatter by so much [rad], and all stamps [s]."""
    dice = random.Random(4)
    window, watch = EncoderWindow(100 * MS, 50 * MS, 200 * MS), ScatterWatch(fastest=40.0)
    for number in range(300):
        at = 0.01 * number + dice.gauss(0.0, stamps)
        speeds = zip((SPEED, -4.0, -4.0), angles, strict=True)
        first, second, third = (speed * at + dice.gauss(0.0, off) for speed, off in speeds)
        window.add(EncoderSample(BASE + 10 * number * MS, (first, second, third), NOTHING))
        if number % 5 == 4:
            watch.take(window.at(BASE + 10 * number * MS))
    return watch


@pytest.mark.parametrize("lossy", [0, 1, 2])
def test_an_encoder_that_loses_counts_is_no_scatter_of_stamps(lossy: int) -> None:
    """One wheel's angle comes in leaps; what the other two show agrees with the stamps."""
    angles = [0.0, 0.0, 0.0]
    angles[lossy] = 0.1
    assert _noisy((angles[0], angles[1], angles[2])).seconds < 1e-9
    shaken = _noisy((angles[0], angles[1], angles[2]), stamps=0.0005)
    assert shaken.seconds == pytest.approx(0.0005, rel=0.4)


def test_an_angle_that_scatters_a_little_more_than_others_is_not_left_out() -> None:
    # sqrt(0.02^2 + 2 x 0.01^2) rad over sqrt(8^2 + 2 x 4^2) rad/s
    assert _noisy((0.02, 0.01, 0.01)).seconds == pytest.approx(0.0025, rel=0.15)


def test_a_wheel_that_turns_alone_cannot_say_what_scatters() -> None:
    dice = random.Random(4)
    window, watch = EncoderWindow(100 * MS, 50 * MS, 200 * MS), ScatterWatch(fastest=40.0)
    for number in range(300):
        turned = SPEED * 0.01 * number + dice.gauss(0.0, 0.05)
        window.add(EncoderSample(BASE + 10 * number * MS, (turned, 0.0, 0.0), NOTHING))
        if number % 5 == 4:
            watch.take(window.at(BASE + 10 * number * MS))
    assert watch.seconds == pytest.approx(0.05 / SPEED, rel=0.3)


def test_ticks_whose_scatter_does_not_show_change_nothing() -> None:
    watch = _watched(_shuffled(200.0), lambda time: SPEED * time)
    for _ in range(30):
        watch.take(WheelEstimate(np.zeros(3), np.zeros(3)))
    assert watch.is_disorder


def test_a_second_of_order_is_enough() -> None:
    watch = _watched(_shuffled(200.0), lambda time: SPEED * time)
    for _ in range(20):
        watch.take(WheelEstimate(np.full(3, 8.0), np.zeros(3), scatter=0.001))
    assert not watch.is_disorder
    assert watch.seconds == 0.001


@pytest.mark.parametrize("turns", [0.4, 1.0, 2.55, 6.7])
def test_bands_can_hold_what_coarse_encoders_round(turns: float) -> None:
    """64 counts a motor turn: of the speed's errors 99 % lie within 3.3 of what is stated."""
    count, dice = 2.0 * math.pi / (64 * 15), random.Random(5)
    window, watch = EncoderWindow(70 * MS, 50 * MS, 200 * MS), ScatterWatch(fastest=40.0)
    held = []
    for number in range(6000):
        stamp = BASE + 10 * number * MS + round(MS * max(-3.0, min(3.0, dice.gauss(0.0, 0.7))))
        turned = 0.01 * number * turns
        angles = [count * math.floor(share * turned / count) for share in (1.0, -0.4, -0.6)]
        window.add(EncoderSample(stamp, (angles[0], angles[1], angles[2]), NOTHING))
        if number % 5 == 4 and number > 1000:
            found = window.at(BASE + 10 * number * MS)
            watch.take(found)
            counts = watch.counts(window.resolution)
            for speed, share in zip(found.speed.tolist(), (1.0, -0.4, -0.6), strict=True):
                noise = found.gain * max(watch.seconds * abs(share) * turns, counts)
                held.append(abs(speed - share * turns) < 3.3 * noise)
                assert noise < 0.25
    assert sum(held) > 0.99 * len(held)


def test_even_steps_are_no_resolution() -> None:
    """What differs in the steps of a perfect motion is a lost sample, not a count."""
    times = [time for time in range(0, 3000, 10) if time % 990]
    watch = _watched(times, lambda time: SPEED * time)
    assert watch.counts(0.08) < 0.02
    true = _watched(list(range(0, 3000, 10)), lambda time: SPEED * time)
    assert true.counts(0.08) < 1e-9


def test_what_was_seen_can_be_forgotten() -> None:
    watch = _watched(_shuffled(200.0), lambda time: SPEED * time)
    watch.clear()
    assert not watch.is_disorder
    assert watch.seconds == 0.0
