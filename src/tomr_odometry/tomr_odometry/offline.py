"""A recording through the odometry, as fast as it can."""

from collections.abc import Iterator
from typing import Any

from tomr_odometry.estimator import Estimate, SlipOdometry
from tomr_odometry.topics import odometry_inputs
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import Recording, resolve_topic
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Complaints, Input


def found_inputs(
    recording: Recording, inputs: tuple[Input, ...], namespace: str | None = None
) -> dict[str, Input]:
    """Inputs by the name under which a recording holds them. Raises InputError without encoders,
    or where a topic has another type."""
    found: dict[str, Input] = {}
    for item in inputs:
        topic = resolve_topic(recording, item.topic, namespace)
        if topic is None:
            continue
        types = (item.type_name, *item.other_types)
        if recording.topics[topic] not in types:
            raise InputError(
                f"{recording.path}: {topic} is a {recording.topics[topic]}, needs {types[0]}: "
                "remap it or set measurement.source in robot.yaml"
            )
        found[topic] = item
    if "joint_states" not in {item.topic for item in found.values()}:
        held = ", ".join(recording.topics)
        raise InputError(f"{recording.path}: no joint_states; the recording holds {held}")
    return found


def estimates(
    recording: Recording,
    robot: Robot,
    core: SlipOdometry,
    complaints: Complaints,
    namespace: str | None = None,
) -> Iterator[Estimate]:
    """Play a recording; what is wrong with messages is counted in `complaints`."""
    inputs = found_inputs(recording, odometry_inputs(robot, core), namespace)
    for topic, _, message, receive_ns in recording.messages(inputs):
        problem = _take(inputs[topic], message, receive_ns)
        if problem is not None:
            complaints.note(inputs[topic].topic, problem)
        yield from core.due()


def _take(item: Input, message: Any, receive_ns: int) -> str | None:
    return item.take(message, receive_ns)
