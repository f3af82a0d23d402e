"""Never a confident wrong pose: sensors absent, biased, coarse or frozen; shoves, leaps of time."""

import math
import warnings
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from typing import Any

import numpy as np
import pytest
from odometry_drives import Change, Event, Recorded, as_it_is, contained, drive, ice, off, play

from tomr_odometry.estimate import Estimate

POWER = ("wheel_1/power", "wheel_2/power", "wheel_3/power")
SHOVE = Event("pushed", 2.0, 3.0, (("severity", 1.0), ("force", 8.0), ("azimuth", 1.57)))
DOWN = Event("pushed", 0.0, 9.0, (("severity", 1.0), ("force", 0.4), ("azimuth", 1.57)))
DRIVES: dict[str, Callable[[], Recorded]] = {
    "grip": drive,
    "ice": lambda: drive(ice(3.0, 6.0)),
    "from the start": lambda: drive(ice(0.0, 3.0), moving_from=0.0),
    "shove": lambda: drive(SHOVE),
    "down a slope": lambda: drive(ice(0.0, 9.0), DOWN),
}


@cache
def recorded(name: str) -> Recorded:
    return DRIVES[name]()


def without(*topics: str) -> Change:
    return lambda time, topic, message: None if topic in topics else message


def silent(topic: str, begin: float, end: float = math.inf) -> Change:
    return lambda time, name, message: None if name == topic and begin < time < end else message


def biased(time: float, topic: str, message: Any) -> Any:
    if topic != "imu/data":
        return message
    copy = deepcopy(message)
    copy.linear_acceleration.x += 0.2
    copy.angular_velocity.z += 0.02
    return copy


def spiking(time: float, topic: str, message: Any) -> Any:
    if topic != "imu/data" or abs(time - 4.5) > 0.006:
        return message
    copy = deepcopy(message)
    copy.linear_acceleration.x = 500.0
    return copy


def of_64_counts(time: float, topic: str, message: Any) -> Any:
    if topic != "joint_states":
        return message
    copy, count = deepcopy(message), 2.0 * math.pi / 64
    copy.position = np.floor(np.array(message.position) / count) * count
    return copy


def repeating() -> Change:
    held: list[Any] = []

    def change(time: float, topic: str, message: Any) -> Any:
        if topic != "joint_states" or not 2.5 < time < 3.2:
            return message
        held.append(message.position)
        copy = deepcopy(message)
        copy.position = held[0]
        return copy

    return change


def imu_repeating(since: float) -> Change:
    """A driver that goes on with the last reading of a dead sensor."""
    held: list[Any] = []

    def change(time: float, topic: str, message: Any) -> Any:
        if topic != "imu/data" or time < since:
            return message
        held.append(message)
        copy = deepcopy(message)
        copy.angular_velocity = held[0].angular_velocity
        copy.linear_acceleration = held[0].linear_acceleration
        return copy

    return change


def imu_of_zeros(time: float, topic: str, message: Any) -> Any:
    if topic != "imu/data" or time < 4.0:
        return message
    copy = deepcopy(message)
    for vector in (copy.angular_velocity, copy.linear_acceleration):
        vector.x = vector.y = vector.z = 0.0
    return copy


def leaping(at: float, by: int) -> Change:
    def change(time: float, topic: str, message: Any) -> Any:
        if time < at:
            return message
        copy = deepcopy(message)
        copy.header.stamp.sec += by
        return copy

    return change


# Distance from the true end where wheels grip, and on ice [m].
CHANGES: dict[str, tuple[Change, float, float]] = {
    "as it is": (as_it_is, 0.01, 0.06),
    "no IMU": (without("imu/data"), 0.01, math.inf),
    "biased IMU": (biased, 0.01, 0.06),
    "IMU spikes": (spiking, 0.01, 0.06),
    "IMU dies": (silent("imu/data", 4.0), 0.01, math.inf),
    "IMU repeats itself": (imu_repeating(4.0), 0.06, math.inf),
    "IMU repeats itself from the start": (imu_repeating(0.0), 0.06, math.inf),
    "IMU reads zero": (imu_of_zeros, 0.01, math.inf),
    "encoders pause": (silent("joint_states", 1.6, 2.1), 0.01, 0.06),
    "encoders pause while turning round": (silent("joint_states", 3.6, 4.3), 0.02, 0.2),
    "encoders repeat themselves": (repeating(), 0.02, 0.4),
    "encoders die": (silent("joint_states", 5.0), 0.15, 0.5),
    "64 counts": (of_64_counts, 0.02, 0.15),
    "power of one wheel": (without(POWER[0]), 0.01, 0.06),
    "no power": (without(*POWER), 0.01, 0.06),
    "no command": (without("cmd_vel"), 0.01, 0.06),
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_pose_is_right_or_its_covariance_says_that_it_is_not(name: str) -> None:
    change, gripping, slipping = CHANGES[name]
    for on, most in (("grip", gripping), ("ice", slipping)):
        items = list(play(recorded(on), change))
        assert contained(recorded(on), items) > 0.95, on
        assert off(recorded(on), items[-1]) < most, on
        if on == "grip":
            assert np.mean([item.is_slipping for item in items]) < 0.1
            assert np.mean([np.abs(item.slip).max() > 0.1 for item in items]) < 0.1


@pytest.mark.parametrize("name", ["as it is", "no IMU", "biased IMU", "IMU dies", "64 counts"])
@pytest.mark.parametrize("on", ["from the start", "shove"])
def test_a_start_while_slipping_and_a_shove(name: str, on: str) -> None:
    items = list(play(recorded(on), CHANGES[name][0]))
    assert contained(recorded(on), items) > 0.95
    assert off(recorded(on), items[-1]) < 1.5


@pytest.mark.parametrize("name", ["as it is", "biased IMU", "64 counts"])
def test_a_robot_that_slides_down_while_its_wheels_stand_may_be_anywhere(name: str) -> None:
    items = list(play(recorded("down a slope"), CHANGES[name][0]))
    assert contained(recorded("down a slope"), items) > 0.95
    assert off(recorded("down a slope"), items[-1]) > 3.0  # nothing shows how far


def test_with_an_imu_that_stood_still_first_the_pose_is_sure() -> None:
    def spread(items: list[Estimate]) -> float:
        return math.sqrt(float(np.trace(items[-1].pose_covariance[:2, :2])))

    assert spread(list(play(recorded("grip")))) < 0.02
    assert spread(list(play(recorded("grip"), without("imu/data")))) > 0.5


@pytest.mark.parametrize("by", [20, -20])
def test_where_time_leaps_the_pose_goes_on_and_is_less_sure(by: int) -> None:
    items = list(play(recorded("grip"), leaping(3.0, by)))
    place = next(
        k for k in range(1, len(items)) if items[k].stamp_ns != items[k - 1].stamp_ns + 20_000_000
    )
    before, after = items[place - 1], items[place]
    assert np.hypot(*(after.pose[:2] - before.pose[:2])) < 0.15
    assert math.sqrt(after.pose_covariance[0, 0]) > 5.0


def test_counts_that_leap_and_come_back_do_not_run_away() -> None:
    """Without an IMU: neither a number beyond all bounds nor a slide is left of it."""

    def leap(time: float, topic: str, message: Any) -> Any:
        if topic == "imu/data":
            return None
        if topic != "joint_states" or not 3.0 < time < 3.02:
            return message
        copy = deepcopy(message)
        copy.position = np.array(message.position) + np.array([1e6, 0.0, 0.0])
        return copy

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        items = list(play(recorded("grip"), leap))
    assert all(np.isfinite(item.twist_covariance).all() for item in items)
    assert not items[-1].is_slipping
    assert off(recorded("grip"), items[-1]) < 0.5
