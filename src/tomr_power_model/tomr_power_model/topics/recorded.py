"""The inputs of a stage as a recording holds them."""

from collections.abc import Sequence

from tomr_power_model.errors import InputError
from tomr_power_model.recordings import Recording, resolve_topic
from tomr_power_model.topics.inputs import Input


def recorded_inputs(
    recording: Recording, inputs: Sequence[Input], namespace: str | None = None
) -> dict[str, Input]:
    """Each input that is there, by its recorded name.

    Raises InputError if a topic has another type, or without encoders.
    """
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
