"""A robot whose motors' drivers publish each its own JointState is diagnosed like any other."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tomr_fault_diag.diagnosis.offline import find_topics
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.messages.bag import bag_message
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot

BAG = Path(__file__).parents[1] / "bags" / "circle_encoder_lost"
ROBOT = shipped_robot("reference")


def _parts(message: Any) -> Iterator[Any]:
    """A JointState for each wheel, and one of an arm."""
    for number, name in enumerate(message.name):
        fields = {
            key: getattr(message, key)[number : number + 1]
            for key in ("position", "velocity", "effort")
        }
        yield bag_message(
            "sensor_msgs/msg/JointState", header=message.header, name=[name], **fields
        )
    yield bag_message(
        "sensor_msgs/msg/JointState", header=message.header, name=["elbow"], position=[1.0]
    )


def _states(is_split: bool) -> list[tuple[int, str]]:
    pipeline = Pipeline(ROBOT, DiagnosisSettings.of({}, "test"))
    found = []
    with open_recording(BAG) as recording:
        topics = find_topics(recording, pipeline.inputs)
        for topic, _, message, receive_ns in recording.messages(topics):
            is_joints = is_split and topics[topic] == "joint_states"
            for part in _parts(message) if is_joints else [message]:
                step = pipeline.take(topics[topic], part, receive_ns)
                found += [(item.stamp_ns, item.state.name) for item in step.diagnoses]
    return found


def test_wheels_in_messages_of_their_own_are_diagnosed_alike() -> None:
    whole, apart = _states(is_split=False), _states(is_split=True)
    assert len(whole) > 20
    assert len({name for _, name in whole}) > 2
    later = whole[0][0] + 1_000_000_000  # the first sample has one wheel
    assert apart[-1] == whole[-1]
    assert [item for item in apart if item[0] > later] == [
        item for item in whole if item[0] > later
    ]
