"""The odometry on simulated drives: exact where nothing slides, honest where sensors fail."""

import math
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from odometry_drives import ROBOT, START, Recorded, contained, drive, ice, off, play

from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.topics import estimate_messages
from tomr_power_model.slides.body import body_of

ICE = (3.0, 6.0)  # s


@pytest.fixture(scope="module")
def gripping() -> Recorded:
    return drive()


@pytest.fixture(scope="module")
def slippery() -> Recorded:
    return drive(ice(*ICE))


def test_where_nothing_slides_the_pose_is_that_of_the_wheels(gripping: Recorded) -> None:
    items = list(play(gripping))
    assert off(gripping, items[-1]) < 0.01
    assert not any(item.is_slipping for item in items)
    assert items[-1].words == "gripping"


@pytest.mark.parametrize("has_imu", [True, False], ids=["imu", "no imu"])
def test_stops_seen_by_fine_counts_are_neither_slip_nor_frozen_encoders(has_imu: bool) -> None:
    # A stop ends in some steps of few counts, and then of none.
    body, radius = body_of(ROBOT)
    core, random, count = SlipOdometry(ROBOT), np.random.default_rng(0), 2e-4
    way, speeds, items = 0.0, [0.0], []
    for sample in range(1, 1500):
        stamp = START + sample * 10_000_000
        wanted = 0.4 if 1.0 < 0.01 * sample % 3.0 < 1.7 else 0.0
        change = min(max(wanted - speeds[-1], -0.012), 0.012)
        way += 0.01 * (speeds[-1] + 0.5 * change)
        speeds.append(speeds[-1] + change)
        angle = np.floor(body.rows @ (0.8 * way, 0.6 * way, 0.0) / radius / count) * count
        core.encoders(stamp, (angle[0], angle[1], angle[2]), (0.0, 0.0, 0.0))
        if has_imu:
            noise = random.normal(0.0, (0.002, 0.002, 0.002, 0.03, 0.03, 0.03))
            felt = np.array((0.0, 0.0, 0.0, 80.0 * change, 60.0 * change, 9.81)) + noise
            core.imu(stamp - 5_000_000, tuple(felt.tolist()))
        items += list(core.due())
    assert not any(item.is_slipping or (np.abs(item.slip) > 0.1).any() for item in items)
    off = [item.twist[0] - 0.8 * speeds[(item.stamp_ns - START) // 10_000_000] for item in items]
    assert np.sqrt(np.mean(np.square(off))) < 0.0012
    assert math.hypot(*(items[-1].pose[:2] - (0.8 * way, 0.6 * way))) < 0.002


def test_ice_is_noticed_soon_and_the_way_is_found(slippery: Recorded) -> None:
    items = list(play(slippery))
    body, radius = body_of(ROBOT)
    angles = np.array(
        [m.position[:3] for _, topic, m in slippery.messages if topic == "joint_states"]
    )
    by_wheels = body.to_twist @ ((angles[-1] - angles[0]) * radius)
    plain = math.hypot(by_wheels[0] - slippery.end[0], by_wheels[1] - slippery.end[1])
    assert off(slippery, items[-1]) < 0.5 * plain
    first = next(item for item in items if item.is_slipping)
    assert ICE[0] <= 1e-9 * (first.stamp_ns - START) < 4.5
    assert contained(slippery, items) > 0.95


def test_encoders_that_repeat_themselves_while_driving_are_waited_for(gripping: Recorded) -> None:
    held: list[Any] = []

    def repeated(time: float, topic: str, message: Any) -> Any:
        if topic == "imu/data":
            return None
        if topic != "joint_states" or not 2.5 < time < 3.2:
            return message
        held.append(message.position)
        copy = deepcopy(message)
        copy.position = held[0]
        return copy

    assert off(gripping, list(play(gripping, repeated))[-1]) < 0.01


def test_what_is_missing_is_said(gripping: Recorded) -> None:
    def without(time: float, topic: str, message: Any) -> Any:
        return None if topic in ("imu/data", "wheel_2/power") else message

    items = list(play(gripping, without))
    assert items[-1].missing == ("imu/data", "wheel_2/power")
    assert any("less surely than an IMU" in text for text in items[-1].assumed)


def test_where_one_power_is_left_the_wheels_are_taken_for_gripping(slippery: Recorded) -> None:
    def without(time: float, topic: str, message: Any) -> Any:
        return None if topic in ("imu/data", "wheel_2/power", "wheel_3/power") else message

    items = list(play(slippery, without))
    assert not any(item.probability.any() for item in items)
    assert "the power of two motors" in items[-1].assumed[-1]


def test_power_alone_shows_slides(slippery: Recorded, gripping: Recorded) -> None:
    """Without an IMU; where nothing slides the pose is that of the wheels."""
    settings = OdometrySettings(use_imu=False)
    plain = evolve(settings, use_power=False)
    ours, wheels = (list(play(slippery, settings=given)) for given in (settings, plain))
    assert off(slippery, ours[-1]) < 0.7 * off(slippery, wheels[-1])
    assert any(item.is_slipping for item in ours)
    assert contained(slippery, ours) > 0.95
    ours, wheels = (list(play(gripping, settings=given)) for given in (settings, plain))
    assert not any(item.is_slipping for item in ours)
    assert ours[-1].pose == pytest.approx(wheels[-1].pose, abs=1e-6)


def _heavy(message: Any) -> None:
    message.linear_acceleration.z += 3.0


def _tilting(message: Any) -> None:
    message.angular_velocity.x += 1.0


def _tilting_without_weight(message: Any) -> None:
    message.angular_velocity.x += 1.0
    message.linear_acceleration_covariance[0] = -1.0


@pytest.mark.parametrize("every", [1, 4], ids=["100 Hz", "25 Hz"])
@pytest.mark.parametrize("lift", [_heavy, _tilting, _tilting_without_weight])
def test_a_lifted_robot_is_distinguished_from_one_that_slips(
    gripping: Recorded, lift: Callable[[Any], None], every: int
) -> None:
    count = 0

    def lifted(time: float, topic: str, message: Any) -> Any:
        nonlocal count
        if topic != "imu/data":
            return message
        count += 1
        if count % every:
            return None
        if not 3.0 < time < 3.3:
            return message
        copy = deepcopy(message)
        lift(copy)
        return copy

    items = list(play(gripping, lifted))
    assert any(item.is_carried for item in items)
    assert "carried" in next(item for item in items if item.is_carried).words
    before = next(item for item in items if item.is_carried).pose_covariance[0, 0]
    assert items[-1].pose_covariance[0, 0] > before + 0.05


def test_slip_ratios_are_the_true_ones(slippery: Recorded) -> None:
    body, radius = body_of(ROBOT)
    samples = [(t, m.position[:3]) for t, topic, m in slippery.messages if topic == "joint_states"]
    times = np.array([time for time, _ in samples])
    angles = np.array([angle for _, angle in samples])
    off, largest = [], 0.0
    for item in play(slippery):
        time = 1e-9 * (item.stamp_ns - START)
        if not 0.1 < time < 8.8:
            continue
        before, after = (
            np.array([np.interp(time + step, times, column) for column in angles.T])
            for step in (-0.05, 0.0)
        )
        rim = (after - before) / 0.05 * radius
        middle = time - 0.025  # of the samples that show the rims' speed
        twist = [np.interp(middle, slippery.times, column) for column in slippery.twist.T]
        ground = body.rows @ np.array(twist)
        larger = np.maximum(np.abs(rim), np.abs(ground))
        true = np.where(larger > 0.05, (rim - ground) / np.maximum(larger, 0.05), 0.0)
        off.append(np.where(larger > 0.05, item.slip - true, 0.0))
        largest = max(largest, float(np.abs(true).max()))
    assert largest > 0.8
    assert np.sqrt(np.mean(np.square(off))) < 0.05


def test_messages_hold_ratios_and_a_covariance(slippery: Recorded) -> None:
    core = SlipOdometry(ROBOT)
    item = list(play(slippery))[200]
    odometry, slip = list(estimate_messages(ROBOT, item, core.settings))[:2]
    assert len(odometry.message.fields["pose"].fields["covariance"]) == 36  # type: ignore[attr-defined]
    assert slip.message.fields["name"] == list(ROBOT.wheel_names)
    assert all(abs(value) <= 1.0 for value in slip.message.fields["position"])  # type: ignore[attr-defined]


def test_encoders_that_are_described_as_flawed_are_read_so() -> None:
    half = {"sensor.encoder_scale": ({"scale": 0.5},) * 3}
    flawed, poses = evolve(ROBOT, physics={**ROBOT.physics, **half}), []
    for robot, shown in ((ROBOT, 1.0), (flawed, 0.5)):
        core = SlipOdometry(robot)
        for sample in range(200):
            ahead = 0.05 * shown * sample
            core.encoders(START + 10_000_000 * sample, (ahead, -ahead, 0.0), (0.0, 0.0, 0.0))
        poses.append(list(core.due())[-1].pose)
    assert np.hypot(*poses[0][:2]) > 0.2
    np.testing.assert_allclose(poses[1], poses[0], atol=1e-3)


def test_a_robot_that_measures_its_total_alone_lacks_no_power_of_wheels() -> None:
    core = SlipOdometry(evolve(ROBOT, measurement=evolve(ROBOT.measurement, source="total_only")))
    for tick in range(10):
        core.encoders(START + 20_000_000 * tick, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    (*_, item) = core.due()
    assert dict(item.sensors) == {"encoders": "used", "imu/data": "not there"}
    assert item.missing == ("imu/data",)
