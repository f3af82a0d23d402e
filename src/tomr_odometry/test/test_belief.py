"""An IMU that is not as described: neither a pose nor slip comes of it for long."""

import math
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from odometry_drives import ROBOT, START, Recorded, contained, drive, ice, off, play

from tomr_odometry.belief import Belief
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.topics import estimate_messages

Change = Callable[[Any], None]


@pytest.fixture(scope="module")
def gripping() -> Recorded:
    return drive()


def changed(change: Change) -> Callable[[float, str, Any], Any]:
    """An IMU that measures otherwise."""

    def made(time: float, topic: str, message: Any) -> Any:
        if topic == "imu/data":
            message = deepcopy(message)
            change(message)
        return message

    return made


def turn_about(message: Any) -> None:
    force = message.linear_acceleration
    force.x, force.y = -force.x, -force.y


def lie_down(message: Any) -> None:
    for values in (message.angular_velocity, message.linear_acceleration):
        values.x, values.z = values.z, -values.x


@pytest.mark.parametrize("change", [turn_about, lie_down])
def test_one_that_is_mounted_otherwise_is_left_out(gripping: Recorded, change: Change) -> None:
    items = list(play(gripping, changed(change)))
    found = [item for item in items if "imu/data" in item.missing]
    assert 1e-9 * (found[0].stamp_ns - START) < 6.5
    assert off(gripping, items[-1]) < 0.02
    assert not any(item.is_slipping for item in found[20:])
    assert contained(gripping, found) == 1.0
    words = items[-1].words
    assert words.startswith("gripping; without imu/data (not used: imu/data is mounted otherwise")
    assert dict(items[-1].sensors)["imu/data"].startswith("not used: ")
    assert any("less surely than an IMU" in text for text in items[-1].assumed)
    settings = OdometrySettings()
    published = [one for item in found[-9:] for one in estimate_messages(ROBOT, item, settings)]
    report = next(one.message for one in published if one.topic == "/diagnostics")
    assert [status.fields["message"] for status in report.fields["status"]] == [words]


def in_degrees(message: Any) -> None:
    message.angular_velocity.z *= 180.0 / math.pi


def test_nothing_of_one_that_is_left_out_moves_the_robot_on() -> None:
    """Nor do samples that came before that was known and had not been used yet."""
    round_about = drive(turning=2.0)
    items = list(play(round_about, changed(in_degrees)))
    found = [item for item in items if "imu/data" in item.missing]
    assert "degrees per second" in found[-1].words
    assert max(abs(item.twist[2]) for item in found) < 1.2  # 1 rad/s is asked for
    assert off(round_about, items[-1]) < 0.02
    assert items[-1].pose[2] == pytest.approx(round_about.pose[-1, 2], abs=0.02)


def test_ice_does_not_make_an_imu_wrong() -> None:
    slippery = drive(ice(1.5, 8.0))
    items = list(play(slippery))
    assert not any(item.missing for item in items)
    assert any(item.is_slipping for item in items)


def test_who_wants_no_imu_is_told_of_none(gripping: Recorded) -> None:
    items = list(play(gripping, changed(turn_about), OdometrySettings(use_imu=False)))
    assert items[-1].words == "gripping; without imu/data"


def test_the_pose_of_the_wheels_goes_on_where_the_robot_is() -> None:
    """After a leap of the stamps, and from there by the ways of the rims."""
    belief = Belief(ROBOT, np.eye(3))
    belief.clear(np.array([1.0, 2.0, math.pi / 2.0]))
    belief.look(START, np.zeros(3), np.array([0.5, 0.0, 0.0]))
    belief.look(START + 10_000_000, np.zeros(3), np.array([0.8, 0.0, 0.1]))
    assert belief.pose == pytest.approx(
        (1.0 - 0.3 * math.sin(0.05), 2.5 + 0.3 * math.cos(0.05), math.pi / 2.0 + 0.1), abs=1e-3
    )


def test_after_a_leap_the_wheels_go_on_where_the_robot_is() -> None:
    core = SlipOdometry(ROBOT)
    core._x[:3] = (1.0, 2.0, 0.5)
    core._start_afresh(START)
    assert core._belief.pose == pytest.approx((1.0, 2.0, 0.5))
