"""The odometry on simulated drives: exact where nothing slides, honest where sensors fail."""

import math
from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from attrs import frozen

from tomr_odometry.estimator import Estimate, SlipOdometry
from tomr_odometry.start import body_of
from tomr_odometry.topics import estimate_messages, odometry_inputs
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.plant.samples import command_sample
from tomr_sim_bridge.plant.simulation import Simulation

ROBOT = shipped_robot("reference")
START = 1_700_000_000_000_000_000
ICE = (3.0, 6.0)  # s
Change = Callable[[float, str, Any], Any]


@frozen
class Recorded:
    """Messages of a drive by time [s] and topic, and the true way at its end [m]."""

    messages: tuple[tuple[float, str, Any], ...]
    end: tuple[float, float]


def _drive(slippery: bool) -> Recorded:
    simulation, found, end = Simulation(ROBOT, 3, start_ns=START), [], (0.0, 0.0)
    for count in range(180):
        time = 0.05 * count
        stamp = START + round(1e9 * time)
        if slippery and abs(time - ICE[0]) < 1e-6:
            simulation.set_fault("floor_slippery", severity=0.95)
        if slippery and abs(time - ICE[1]) < 1e-6:
            simulation.set_fault("floor_slippery", severity=0.0)
        speed = 0.5 if 1.0 < time < 4.0 else -0.3 if 4.0 < time < 8.0 else 0.0
        sample = command_sample(stamp, speed, 0.1 * speed, 0.0)
        simulation.command(speed, 0.1 * speed, 0.0, stamp_ns=stamp)
        found.append((time, sample.topic, to_bag(sample.message)))
        for item in simulation.step_to(stamp + 50_000_000):
            message = to_bag(item.message)
            if item.topic == "ground_truth/odom":
                place = message.pose.pose.position
                end = (float(place.x), float(place.y))
            found.append((1e-9 * (item.stamp_ns - START), item.topic, message))
    return Recorded(tuple(found), end)


@pytest.fixture(scope="module")
def gripping() -> Recorded:
    return _drive(False)


@pytest.fixture(scope="module")
def slippery() -> Recorded:
    return _drive(True)


def _as_it_is(time: float, topic: str, message: Any) -> Any:
    return message


def _play(drive: Recorded, change: Change = _as_it_is) -> Iterator[Estimate]:
    core = SlipOdometry(ROBOT)
    inputs = {item.topic: item for item in odometry_inputs(ROBOT, core)}
    for time, topic, message in drive.messages:
        if topic in inputs:
            changed = change(time, topic, message)
            if changed is not None:
                inputs[topic].take(changed, START + round(1e9 * time))
        yield from core.due()


def _off(drive: Recorded, estimate: Estimate) -> float:
    return math.hypot(estimate.pose[0] - drive.end[0], estimate.pose[1] - drive.end[1])


def _covers(drive: Recorded, estimate: Estimate) -> bool:
    """Whether the true end lies within five standard deviations."""
    spread = math.sqrt(float(np.trace(estimate.pose_covariance[:2, :2])))
    return _off(drive, estimate) < max(5.0 * spread, 0.01)


def test_where_nothing_slides_the_pose_is_that_of_the_wheels(gripping: Recorded) -> None:
    items = list(_play(gripping))
    assert _off(gripping, items[-1]) < 0.01
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
    items = list(_play(slippery))
    body, radius = body_of(ROBOT)
    angles = np.array(
        [m.position[:3] for _, topic, m in slippery.messages if topic == "joint_states"]
    )
    by_wheels = body.to_twist @ ((angles[-1] - angles[0]) * radius)
    plain = math.hypot(by_wheels[0] - slippery.end[0], by_wheels[1] - slippery.end[1])
    assert _off(slippery, items[-1]) < 0.5 * plain
    first = next(item for item in items if item.is_slipping)
    assert ICE[0] <= 1e-9 * (first.stamp_ns - START) < 4.5
    assert _covers(slippery, items[-1])


def _without(*topics: str) -> Change:
    return lambda time, topic, message: None if topic in topics else message


def _dies(topic: str, at: float) -> Change:
    return lambda time, name, message: None if name == topic and time > at else message


def _biased(time: float, topic: str, message: Any) -> Any:
    if topic != "imu/data":
        return message
    copy = deepcopy(message)
    copy.linear_acceleration.x += 0.2
    copy.angular_velocity.z += 0.02
    return copy


def _frozen(time: float, topic: str, message: Any) -> Any:
    return None if topic == "joint_states" and 1.6 < time < 2.1 else message


@pytest.mark.parametrize(
    "change",
    [
        _without("wheel_1/power"),
        _without("wheel_1/power", "wheel_2/power", "wheel_3/power"),
        _biased,
        _frozen,
        _dies("imu/data", 2.0),
        _without("imu/data"),
        _without("cmd_vel"),
        _dies("joint_states", 5.0),
    ],
    ids=["power of one", "no power", "bias", "frozen", "imu dies", "no imu", "no command", "blind"],
)
def test_never_a_confident_wrong_pose(
    gripping: Recorded, slippery: Recorded, change: Change
) -> None:
    for drive in (gripping, slippery):
        items = list(_play(drive, change))
        assert np.isfinite(items[-1].pose).all()
        assert _covers(drive, items[-1])


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

    assert _off(gripping, list(_play(gripping, repeated))[-1]) < 0.01


def test_what_is_missing_is_said(gripping: Recorded) -> None:
    items = list(_play(gripping, _without("imu/data", "wheel_2/power")))
    assert items[-1].missing == ("imu/data", "wheel_2/power")
    assert any("without an IMU" in text for text in items[-1].assumed)


def test_a_lifted_robot_is_told_from_one_that_slips(gripping: Recorded) -> None:
    def lifted(time: float, topic: str, message: Any) -> Any:
        if topic != "imu/data" or not 3.0 < time < 3.3:
            return message
        copy = deepcopy(message)
        copy.linear_acceleration.z += 3.0
        return copy

    items = list(_play(gripping, lifted))
    assert any(item.is_carried for item in items)
    before = next(item for item in items if item.is_carried).pose_covariance[0, 0]
    assert items[-1].pose_covariance[0, 0] > before + 0.05


def test_a_leap_of_the_clock_starts_afresh(gripping: Recorded) -> None:
    core = SlipOdometry(ROBOT)
    zero = (0.0, 0.0, 0.0)
    for sample in range(50):
        core.encoders(START + sample * 10_000_000, (0.1 * sample,) * 3, zero)
    assert len(list(core.due())) > 10
    for sample in range(50):
        core.encoders(START - 10_000_000_000 + sample * 10_000_000, zero, zero)
    items = list(core.due())
    assert items[-1].stamp_ns < START
    assert items[-1].pose == pytest.approx(np.zeros(3), abs=1e-6)


def test_messages_hold_ratios_and_a_covariance(slippery: Recorded) -> None:
    core = SlipOdometry(ROBOT)
    item = list(_play(slippery))[200]
    odometry, slip = list(estimate_messages(ROBOT, item, core.settings))[:2]
    assert len(odometry.message.fields["pose"].fields["covariance"]) == 36  # type: ignore[attr-defined]
    assert slip.message.fields["name"] == list(ROBOT.wheel_names)
    assert all(abs(value) <= 1.0 for value in slip.message.fields["position"])  # type: ignore[attr-defined]
