"""A recording through the pipeline, or through several side by side, as fast as it can."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_power_model.drive.sources import TOTAL_TOPIC
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import Recording
from tomr_power_model.topics.inputs import Input
from tomr_power_model.topics.recorded import recorded_inputs

Note = Callable[[str, Any, int], None]  # topic of the contract, message, receive stamp [ns]


def find_topics(
    recording: Recording, inputs: tuple[Input, ...], namespace: str | None = None
) -> dict[str, str]:
    """Recorded topic of each input that is there: {recorded name: contract name}.

    Raises InputError if a topic has another type, or if so much is missing that nothing could
    be compared.
    """
    found = {
        topic: item.topic for topic, item in recorded_inputs(recording, inputs, namespace).items()
    }
    power = {item.topic for item in inputs} - {"joint_states", "cmd_vel", "imu/data"}
    motors = power - {TOTAL_TOPIC} or power
    if motors and not motors & set(found.values()):
        alone = ": set measurement.source: total_only" if TOTAL_TOPIC in found.values() else ""
        raise InputError(
            f"{recording.path}: none of {', '.join(sorted(motors))}: are the wheels named "
            f"otherwise in robot.yaml, or is only the whole robot's power known{alone}? The "
            f"recording holds {', '.join(recording.topics)}"
        )
    return found


def check_wheels(recording: Recording, topic: str, wheel_names: tuple[str, str, str]) -> None:
    """Raise InputError if joint_states are there and none has any of the robot's wheels."""
    others: dict[str, None] | None = None
    for _, _, message, _ in recording.messages([topic]):
        if set(message.name) & set(wheel_names):
            return
        others = (others or {}) | dict.fromkeys(message.name)
    if others is not None:
        raise InputError(
            f"{recording.path}: {topic} has {', '.join(others) or 'no joints'}, but "
            f"robot.yaml names {', '.join(wheel_names)}: set robot.wheel_names"
        )


def replay(
    recording: Recording,
    pipelines: Sequence[Pipeline],
    namespace: str | None = None,
    note: Note | None = None,
) -> Iterator[tuple[int, list[Step]]]:
    """Yield (receive stamp [ns], what it brought about in each pipeline) for every message.

    All pipelines are of the same robot; `note` hears of each message before they do.
    """
    topics = find_topics(recording, pipelines[0].inputs, namespace)
    joints = next(topic for topic, name in topics.items() if name == "joint_states")
    check_wheels(recording, joints, pipelines[0].robot.wheel_names)
    for topic, _, message, receive_ns in recording.messages(topics):
        name = topics[topic]
        if note is not None:
            note(name, message, receive_ns)
        yield receive_ns, [pipeline.take(name, message, receive_ns) for pipeline in pipelines]


def diagnose(
    recording: Recording, pipeline: Pipeline, namespace: str | None = None
) -> Iterator[tuple[int, Step]]:
    """Yield (receive stamp [ns], what it brought about) for every message of the inputs."""
    for receive_ns, (step,) in replay(recording, [pipeline], namespace):
        yield receive_ns, step
