"""A robot that brakes to a halt that it was not asked for."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import shipped_robot

Array = NDArray[np.float64]
Motion = Callable[[float], Array]

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
ROBOT = shipped_robot("reference")  # ramps by 2 m/s^2, and yaw by that over 0.2 m
SPEED, YAW = 1.2, 2.0  # m/s, rad/s: 0.6 and 0.2 s of braking
BEGIN = 1.0  # s
BAND = 0.2  # rad/s
TO_WHEELS = twist_to_wheels(ROBOT)


def wheels(speed: float, yaw: float) -> Array:
    return np.asarray(TO_WHEELS @ [0.8 * speed, 0.6 * speed, yaw])


def braking(time: float, begin: float = BEGIN, rate: float = 2.0) -> Array:
    lost = rate * max(time - begin, 0.0)
    yaw = YAW * max(0.0, 1.0 - lost / (ROBOT.robot_radius * YAW))
    return wheels(max(SPEED - lost, 0.0), yaw)


def driving(time: float) -> Array:
    return wheels(SPEED, YAW)


def found(
    measured: Motion, expected: Motion = driving, period_ms: int = 50, most_far: int = 3
) -> list[int]:
    """When it is said to brake unasked [ms], in 2 s."""
    watch, times = BrakingWatch(ROBOT), []
    for at_ms in range(0, 2000, period_ms):
        here, asked = measured(at_ms / 1e3), expected(at_ms / 1e3)
        far = min(int((np.abs(here - asked) > 3.0 * BAND).sum()), most_far)
        if watch.take(BASE + at_ms * MS, here, asked, far):
            times.append(at_ms)
    return times


@pytest.mark.parametrize("period", [10, 25, 50])
def test_a_robot_that_brakes_at_its_drivers_limit_unasked_is_known_before_it_stands(
    period: int,
) -> None:
    assert 1200 < found(braking, period_ms=period)[0] <= 1350


def test_one_that_brakes_as_it_is_asked_to_does_what_it_should() -> None:
    assert not found(braking, braking)
    assert not found(braking, lambda time: braking(time, BEGIN - 0.06))  # a command was late
    assert not found(braking, lambda time: braking(time, BEGIN + 0.06))


def test_other_motions_are_not_what_its_drivers_do_to_halt() -> None:
    assert not found(lambda time: braking(time, rate=1.2))
    assert not found(lambda time: braking(time, rate=3.5))
    assert not found(lambda time: driving(time) * (1.0 if time < BEGIN else 0.6))
    assert not found(lambda time: driving(time) * np.exp(-3.0 * max(time - BEGIN, 0.0)))
    assert not found(lambda time: wheels(SPEED - 2.0 * max(time - BEGIN, 0.0), YAW))


def test_what_has_only_just_gone_astray_is_not_known_yet() -> None:
    """Until then it braked as it was asked to."""

    def asked(time: float) -> Array:
        return braking(time) if time < 1.25 else driving(time)

    assert found(braking, asked)[0] == 1450


def test_encoders_are_not_exact() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.2, (41, 3))
    assert found(lambda time: np.asarray(braking(time) + noise[round(20 * time)]))[0] <= 1350


def test_one_wheel_alone_may_have_a_fault_of_its_own() -> None:
    assert not found(braking, most_far=1)


def test_a_slow_robot_loses_too_little_to_be_known_by_it() -> None:
    # Its fastest wheel turns by 1.2 rad/s, or 1.7.
    for share, is_known in ((0.055, False), (0.075, True)):
        speed, yaw = share * SPEED, share * YAW

        def halting(time: float, speed: float = speed, yaw: float = yaw) -> Array:
            lost = 2.0 * max(time - BEGIN, 0.0)
            return wheels(max(speed - lost, 0.0), max(yaw - lost / ROBOT.robot_radius, 0.0))

        asked = wheels(speed, yaw)
        assert bool(found(halting, lambda _, asked=asked: asked)) is is_known


def test_what_is_not_known_says_nothing() -> None:
    assert not found(lambda time: np.asarray(braking(time) * [np.nan, 1.0, 1.0]))
    free = evolve(ROBOT, controller=evolve(ROBOT.controller, acceleration_limit=0.0))
    watch = BrakingWatch(free)
    ticks = [watch.take(BASE + k * 50 * MS, braking(k / 20), driving(0.0), 3) for k in range(40)]
    assert not any(ticks)


def test_what_was_seen_before_a_break_is_forgotten() -> None:
    watch = BrakingWatch(ROBOT)
    for k in range(26):
        assert not watch.take(BASE + k * 50 * MS, braking(k / 20), driving(0.0), 3 * (k > 20))
    watch.clear()
    assert not watch.take(BASE + 26 * 50 * MS, braking(26 / 20), driving(0.0), 3)
