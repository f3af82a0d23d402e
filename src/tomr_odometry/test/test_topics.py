"""What is read of messages and what is published of an estimate, by hand."""

import math
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from odometry_drives import ROBOT, START

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import spells
from tomr_odometry.topics import (
    ODOM_TOPIC,
    STATUS_TOPIC,
    TF_TOPIC,
    estimate_messages,
    odometry_inputs,
)
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.messages.bag import bag_header, bag_message, to_bag
from tomr_power_model.messages.types import TWIST, TWIST_STAMPED
from tomr_power_model.model.ticks import Arrival

SETTINGS = OdometrySettings()


@pytest.fixture(scope="module")
def resting() -> Estimate:
    """Of a robot that stands."""
    core = SlipOdometry(ROBOT)
    for sample in range(20):
        core.encoders(START + 10_000_000 * sample, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return list(core.due())[-1]


def published(item: Estimate, settings: OdometrySettings = SETTINGS) -> dict[str, Any]:
    found = estimate_messages(ROBOT, item, settings)
    return {one.topic: to_bag(one.message) for one in found}


def test_covariances_stand_where_their_coordinates_are(resting: Estimate) -> None:
    planar = np.array([[1.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 3.0]])
    item = evolve(resting, pose_covariance=planar, twist_covariance=2.0 * planar)
    message = published(item)[ODOM_TOPIC]
    for said, given in ((message.pose, planar), (message.twist, 2.0 * planar)):
        full = np.array(said.covariance).reshape(6, 6)
        assert full[np.ix_([0, 1, 5], [0, 1, 5])] == pytest.approx(given)
        assert np.diag(full)[2:5] == pytest.approx(1e-6)
        assert np.count_nonzero(full) == 12


def test_the_status_names_which_robot_it_is_of(resting: Estimate) -> None:
    item = evolve(resting, stamp_ns=START)
    for namespace, settings, name, hardware_id in (
        ("", SETTINGS, "slip_odometry", "tomr"),
        ("robot_2", OdometrySettings(hardware_id="two"), "/robot_2/slip_odometry", "two"),
    ):
        messages = estimate_messages(ROBOT, item, settings, namespace)
        found = {one.topic: to_bag(one.message) for one in messages}[STATUS_TOPIC]
        assert (found.status[0].name, found.status[0].hardware_id) == (name, hardware_id)


def test_a_transform_is_published_on_request_only(resting: Estimate) -> None:
    assert TF_TOPIC not in published(resting)
    item = evolve(resting, pose=np.array([1.0, 2.0, 0.5]))
    (moved,) = published(item, OdometrySettings(publish_tf=True))[TF_TOPIC].transforms
    assert (moved.header.frame_id, moved.child_frame_id) == ("odom", "base_link")
    assert moved.transform.translation.y == 2.0
    assert moved.transform.rotation.z == pytest.approx(math.sin(0.25))


def test_slip_creep_and_silent_sensors_are_said_apart(resting: Estimate) -> None:
    well = evolve(resting, missing=(), stamp_ns=START)
    creeping = evolve(well, creeping=np.array([0.0, 0.03, 0.0]), sliding=np.array([0.0, 0.03, 0.0]))
    lost = evolve(
        creeping, slides=np.array([False, True, False]), sliding=np.array([0.0, 0.2, 0.0])
    )
    silent = evolve(well, missing=("imu/data",))
    for item, level, words in (
        (well, 0, "gripping"),
        (creeping, 0, "gripping: creep"),
        (lost, 1, "slipping: loss of traction at wheel 2"),
        (silent, 1, "gripping; without imu/data"),
    ):
        (status,) = published(item)[STATUS_TOPIC].status
        level_said = status.level if isinstance(status.level, int) else status.level[0]
        assert (level_said, status.message) == (level, words)
    assert lost.losing == pytest.approx([0.0, 0.17, 0.0])  # less what it creeps


def test_spells_of_slip_that_are_near_are_one(resting: Estimate) -> None:
    slides = {"slides": np.array([True, False, False]), "sliding": np.array([0.2, 0.0, 0.0])}
    slipping = {0.2, 0.4, 1.0, 1.2}
    items = [
        evolve(resting, stamp_ns=START + round(1e9 * t), **(slides if t in slipping else {}))
        for t in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4)
    ]
    assert np.array(spells(items)) == pytest.approx(np.array([[0.2, 0.4], [1.0, 1.2]]))
    del items[4]
    items[3] = evolve(items[3], **slides)
    assert np.array(spells(items)) == pytest.approx(np.array([[0.2, 1.2]]))


def test_a_command_without_a_stamp_counts_when_it_comes() -> None:
    core = SlipOdometry(ROBOT)
    command = next(item for item in odometry_inputs(ROBOT, core) if item.topic == "cmd_vel")
    speed = bag_message("geometry_msgs/msg/Vector3", x=0.3)
    plain = bag_message(TWIST, linear=speed)
    unstamped = bag_message(TWIST_STAMPED, header=bag_header(0), twist=plain)
    for stamp, message in ((START, plain), (START + 50_000_000, unstamped)):
        assert command.take(message, stamp) is None
        assert core.command(stamp, (0.3, 0.0, 0.0)) is Arrival.REPEATED


def test_sensors_that_are_not_to_be_used_are_not() -> None:
    off = SlipOdometry(ROBOT, OdometrySettings(use_imu=False, use_power=False))
    assert "imu/data" not in {item.topic for item in odometry_inputs(ROBOT, off)}
    for sample in range(40):
        stamp, angle = START + 10_000_000 * sample, 0.05 * sample
        off.command(stamp, (0.3, 0.0, 0.0))
        off.encoders(stamp, (angle, angle, angle), (0.0, 0.0, 0.0))
        off.imu(stamp, (0.0, 0.0, 0.0, 0.0, 0.0, 13.0 if sample > 20 else 9.81))
        for wheel in range(3):
            off.power(PowerReading(wheel, stamp, 5.0, 5.0 / 24.0, 24.0))
    last = list(off.due())[-1]
    assert np.isnan(last.traction).all()
    assert "imu/data" in last.missing
    assert not last.is_carried
