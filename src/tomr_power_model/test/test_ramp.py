"""Drivers that ramp what they are commanded otherwise than described."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.ramp import misdescribed_ramp, ramp_shown
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot

ROBOT = shipped_robot("reference")
Array = np.ndarray
PERIOD, FINER = 0.05, 10  # s, and steps in which it is simulated


def described(limit: float) -> Robot:
    return evolve(ROBOT, controller=evolve(ROBOT.controller, acceleration_limit=limit))


def legs(seconds: float = 60.0) -> tuple[Array, Array]:
    """Times [s] and velocities that are commanded [m/s]: legs of 3 s in several directions."""
    time = np.arange(0.0, seconds, PERIOD)
    steps = np.array([0.5, -0.3 + 0.4j, -0.5j, 0.0, -0.4, 0.2 - 0.3j])
    return time, steps[(time // 3.0).astype(int) % len(steps)]


def ramped(velocity: Array, limit: float) -> Array:
    """Means of samples: by a limit of the acceleration [m/s^2], 0: none; then lagged by a loop."""
    now = there = 0j
    found = []
    for wanted in np.repeat(velocity, FINER):
        step = wanted - now
        size = abs(step)
        now += step * min(1.0, limit * PERIOD / FINER / size) if limit and size else step
        there += 0.1 * (now - there)
        found.append(there)
    return np.reshape(found, (-1, FINER)).mean(axis=1)


def wheels(velocity: Array, turned: float = 0.0) -> Array:
    """Speeds of the wheels [rad/s], of velocities that are turned by an angle [rad]."""
    turning = velocity * np.exp(1j * turned)
    twist = np.column_stack([turning.real, turning.imag, np.zeros(len(velocity))])
    return twist @ twist_to_wheels(ROBOT).T


@pytest.mark.parametrize("turned", [0.0, np.pi / 3.0])
@pytest.mark.parametrize(("limit", "true"), [(0.0, 1.0), (2.5, 1.0), (0.5, 1.0), (0.5, 0.3)])
def test_the_limit_that_drivers_keep_to_is_what_to_write(
    limit: float, true: float, turned: float
) -> None:
    time, commanded = legs()
    measured = wheels(ramped(commanded, true), turned)
    measured += 0.02 * np.random.default_rng(1).standard_normal(measured.shape)
    expected = wheels(ramped(commanded, limit), turned)
    found = ramp_shown(time, measured, expected, described(limit))
    assert found == pytest.approx(true, rel=0.04)
    seen, remedy = misdescribed_ramp(found, described(limit))
    assert (f"{limit:g} is described" if limit else "no limit is described") in seen
    assert remedy.startswith(f"write controller.acceleration_limit: {found:.2g}, or")


def _late(commanded: Array) -> Array:
    return np.roll(ramped(commanded, 1.0), 4)


def _late_at_once(commanded: Array) -> Array:
    """By 0.3 s, of drivers that have no ramp."""
    return np.roll(ramped(commanded, 0.0), 6)


def _swings(commanded: Array) -> Array:
    """A loop with other gains, that comes near slowly."""
    slow = [0j]
    for wanted in commanded:
        slow.append(slow[-1] + 0.08 * (wanted - slow[-1]))
    return np.array(slow[1:])


def _half(commanded: Array) -> Array:
    return 0.5 * ramped(commanded, 1.0)


def _stops(commanded: Array) -> Array:
    """Held for 1.5 s of every 3 s."""
    held = np.arange(len(commanded)) % 60 < 30
    return np.where(held, 0.0, ramped(commanded, 1.0))


@pytest.mark.parametrize("change", [_late, _late_at_once, _swings, _half, _stops])
@pytest.mark.parametrize("limit", [1.0, 0.0])
def test_what_else_makes_wheels_slow_is_no_ramp(
    change: Callable[[Array], Array], limit: float
) -> None:
    time, commanded = legs()
    expected = wheels(ramped(commanded, limit))
    if limit == 0.0 and change not in (_swings, _late_at_once):
        expected = wheels(ramped(commanded, 1.0))  # so are the drivers: what differs is the rest
    assert ramp_shown(time, wheels(change(commanded)), expected, described(limit)) is None


def test_as_described_nothing_is_said() -> None:
    time, commanded = legs()
    speeds = wheels(ramped(commanded, 1.0))
    assert ramp_shown(time, speeds, speeds, described(1.0)) is None
    unknown = np.full_like(speeds, np.nan)
    assert ramp_shown(time, unknown, speeds, described(1.0)) is None
    assert ramp_shown(time[:1], speeds[:1], speeds[:1], described(1.0)) is None
    assert misdescribed_ramp(None, ROBOT) == ("", "")


def test_moments_that_are_left_out_are_no_ramp() -> None:
    """Ticks in which nothing is commanded are not looked at: what is before and after belongs
    together as little as two drives."""
    time, commanded = legs()
    measured, expected = wheels(ramped(commanded, 1.0)), wheels(ramped(commanded, 0.0))
    moving = np.abs(expected).max(axis=1) > 0.3
    found = ramp_shown(time[moving], measured[moving], expected[moving], described(0.0))
    assert found == pytest.approx(1.0, rel=0.15)


def test_one_slow_start_is_not_enough() -> None:
    """It may have been a fault, a kerb or a hand."""
    time, commanded = legs(24.0)
    measured, expected = wheels(ramped(commanded, 1.0)), wheels(ramped(commanded, 0.0))
    measured[120:] = expected[120:]
    assert ramp_shown(time, measured, expected, described(0.0)) is None


def test_a_few_slow_starts_in_a_long_drive_are_not_enough() -> None:
    time, commanded = legs(600.0)
    measured, expected = wheels(ramped(commanded, 1.0)), wheels(ramped(commanded, 0.0))
    measured[600:] = expected[600:]
    assert ramp_shown(time, measured, expected, described(0.0)) is None


def test_half_a_ramp_does_not_say_how_steep_it_is() -> None:
    """Where the next command comes before the last is reached, the pace has to do."""
    time, commanded = legs()
    quick = commanded[(time * 6.0 % 60.0 / PERIOD).astype(int) % len(commanded)]  # legs of 0.5 s
    expected = wheels(ramped(quick, 0.0))
    found = ramp_shown(time, wheels(ramped(quick, 1.5)), expected, described(0.0))
    assert found == pytest.approx(1.5, rel=0.05)


def test_what_is_apart_after_gaps_alone_shows_nothing() -> None:
    """No acceleration is known there."""
    block, number = np.divmod(np.arange(200), 5)
    time = PERIOD * (8.0 * block + number)
    velocity = np.full(len(time), 0.5 + 0.0j)
    seen = np.where(number == 0, 0.0, velocity)
    assert ramp_shown(time, wheels(seen), wheels(velocity), described(0.0)) is None


def test_ramps_that_are_turned_back_say_nothing_of_a_whole_ones_way() -> None:
    """Commands of 0.6 s, each fourth of 2.5 s: where 1 m/s^2 takes 1.2 s."""
    spans = [50 if number % 4 == 0 else 12 for number in range(40)]
    speeds = np.where(np.arange(40) % 2, 0.6, -0.6) + 0.0j
    commanded = np.repeat(speeds, spans)
    time = PERIOD * np.arange(len(commanded))
    measured, expected = wheels(ramped(commanded, 1.0)), wheels(ramped(commanded, 0.0))
    found = ramp_shown(time, measured, expected, described(0.0))
    assert found == pytest.approx(1.0, rel=0.04)


def test_legs_from_rest_are_ramps_of_their_own() -> None:
    """To and fro with a stop between, of which nothing is asked: none goes on where one ended."""
    time = np.arange(0.0, 60.0, PERIOD)
    commanded = np.array([0.5, 0.0, -0.5, 0.0])[(time // 2.0).astype(int) % 4] + 0.0j
    measured, expected = wheels(ramped(commanded, 1.0)), wheels(ramped(commanded, 0.0))
    moves = commanded != 0.0
    found = ramp_shown(time[moves], measured[moves], expected[moves], described(0.0))
    assert found == pytest.approx(1.0, rel=0.05)
