"""Robots that are wired, or report, otherwise than described."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomr_fault_diag.diagnosis.offline import check_wheels, find_topics
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_odometry.reference import wheel_path
from tomr_power_model.drive.read import read_drive
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "bench"))

from descriptions import REWIRED, recorded  # noqa: E402

ROBOT = shipped_robot("reference")
Change = Callable[[str, Any], Iterator[tuple[str, Any]]]


def _states(bag: str, change: Change | None = None) -> tuple[list[tuple[int, str]], str]:
    """States and their stamps, and what is said of robot.yaml and the IMU at last."""
    pipeline = Pipeline(ROBOT, DiagnosisSettings.of({}, "test"))
    found = []
    with open_recording(ROOT / "bags" / bag) as recording:
        topics = find_topics(recording, pipeline.inputs)
        for topic, _, message, receive_ns in recording.messages(topics):
            parts = [(topic, message)] if change is None else change(topic, message)
            for place, part in parts:
                step = pipeline.take(topics[place], part, receive_ns)
                found += [(item.stamp_ns, item.state.name) for item in step.diagnoses]
    return found, "; ".join(pipeline.misdescribed())


def test_wheels_in_messages_of_their_own_are_diagnosed_alike() -> None:
    whole, said = _states("circle_encoder_lost")
    apart, same = _states("circle_encoder_lost", REWIRED["a message for each wheel and an arm"])
    assert len(whole) > 20
    assert len({name for _, name in whole}) > 2
    later = whole[0][0] + 1_000_000_000  # the first sample has one wheel
    assert apart[-1] == whole[-1]
    assert [item for item in apart if item[0] > later] == [
        item for item in whole if item[0] > later
    ]
    assert said == same == ""


def test_tools_read_them_alike(tmp_path: Path) -> None:
    bag, apart = ROOT / "bags" / "square", tmp_path / "apart"
    recorded(bag, REWIRED["a message for each wheel and an arm"], apart)
    one, other = (read_drive(path, ROBOT) for path in (bag, apart))
    # The first sample has one wheel: nobody knows yet that others follow.
    np.testing.assert_allclose(other.encoder_time, one.encoder_time, atol=1e-9)
    np.testing.assert_array_equal(other.position[1:], one.position[1:])
    np.testing.assert_array_equal(other.velocity[1:], one.velocity[1:])
    ways = []
    for path in (bag, apart):
        with open_recording(path) as recording:
            ways.append(wheel_path(recording, ROBOT))
    np.testing.assert_array_equal(ways[1].stamps, ways[0].stamps[1:])
    np.testing.assert_allclose(ways[1].pose[-1], ways[0].pose[-1], atol=1e-6)
    with open_recording(apart) as recording:  # though an arm's message is the first
        check_wheels(recording, "/joint_states", ROBOT.wheel_names)
        with pytest.raises(InputError, match="has elbow, wheel_1_joint, wheel_2_joint"):
            check_wheels(recording, "/joint_states", ("left", "right", "back"))


def test_a_robot_that_is_wired_otherwise_is_told_so() -> None:
    _, said = _states("square", REWIRED["one encoder counts backwards"])
    assert "the encoder of wheel_2_joint counts against its sense" in said
    states, said = _states("square", REWIRED["powers of two motors exchanged"])
    assert "the power of wheel_1 is that of wheel_2_joint" in said
    assert states[-1][1] == "unknown"
    _, said = _states("square", REWIRED["angles in revolutions"])
    assert "joint_states seems to give revolutions in place of radians" in said
    assert _states("square")[1] == ""


def test_an_imu_that_lies_on_its_side_is_said_to() -> None:
    states, said = _states("square", REWIRED["imu on its side"])
    assert said.startswith("imu/data is mounted otherwise than described: write robot.imu_rpy: [")
    assert {name for _, name in states} <= {"normal", "waiting", "not observable in this motion"}


@pytest.mark.parametrize("every", [5, 7, 10])
def test_encoders_of_20_to_10_hz_are_no_fault(every: int) -> None:
    count = -1

    def rarely(topic: str, message: Any) -> Iterator[tuple[str, Any]]:
        nonlocal count
        count += topic == "/joint_states"
        if topic != "/joint_states" or count % every == 0:
            yield topic, message

    states, said = _states("square", rarely)
    named = [name for _, name in states]
    assert set(named) <= {"normal", "waiting", "not observable in this motion", "not enough data"}
    assert named.count("normal") > 0.6 * len(named)
    assert said == ""
