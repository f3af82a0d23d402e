"""The recorded drive that the benchmark plays, and what the suite makes of it."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from struct import Struct
from typing import Any

from attrs import frozen

from tomr_fault_diag.diagnosis.offline import find_topics
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.messages.bag import jazzy_typestore, to_bag
from tomr_power_model.messages.outgoing import TYPES
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import shipped_robot

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "bags" / "circle_encoder_lost"
ROBOT = "reference"

_JOINTS = "sensor_msgs/msg/JointState"
_SEAM_NS = 10_000_000  # between two rounds: one encoder period
# The stamp is the first field of every message of a recording, after four bytes of CDR head.
_STAMP = Struct("<iI")
_HEAD = 4


@frozen
class Raw:
    """A serialised message."""

    topic: str
    type_name: str
    data: bytes
    stamp_ns: int


def repeated(seconds: float, source: Path = SOURCE) -> Iterator[Raw]:
    """The messages of a recording over and over, stamps and wheel angles running on."""
    with open_recording(source) as recording:
        messages = [Raw(*message) for message in recording.raw_messages()]
        period = recording.end_ns - recording.start_ns + _SEAM_NS
        end = recording.start_ns + round(seconds * NANOSECONDS)
    joints = [message for message in messages if message.type_name == _JOINTS]
    turned = _joints(joints[-1].data).position - _joints(joints[0].data).position
    shift = 0
    while True:
        for message in messages:
            stamp = message.stamp_ns + shift
            if stamp > end:
                return
            data = _shifted(message.data, shift)
            if message.type_name == _JOINTS:
                state = _joints(data)
                state.position = state.position + shift // period * turned
                data = bytes(jazzy_typestore().serialize_cdr(state, _JOINTS))
            yield Raw(message.topic, message.type_name, data, stamp)
        shift += period


def _joints(data: bytes) -> Any:
    return jazzy_typestore().deserialize_cdr(data, _JOINTS)


def _shifted(data: bytes, shift_ns: int) -> bytes:
    changed = bytearray(data)
    seconds, nanoseconds = _STAMP.unpack_from(changed, _HEAD)
    later = seconds * NANOSECONDS + nanoseconds + shift_ns
    _STAMP.pack_into(changed, _HEAD, *divmod(later, NANOSECONDS))
    return bytes(changed)


def write_bag(messages: Iterable[Raw], path: Path) -> Path:
    """Store messages as a new recording; returns its path."""
    with RecordingWriter(path) as writer:
        for message in messages:
            writer.write_raw(message.topic, message.type_name, message.data, message.stamp_ns)
    return path


@frozen
class Drive:
    """A drive to play: what the robot publishes, and what the three nodes answer."""

    sensors: tuple[Raw, ...]  # only what the nodes read, in the order of the recording
    answers: tuple[tuple[Raw, ...], ...]  # of the nodes to each sensor message
    completing: dict[int, int]  # stamp of a tick: index of the sensor message that completes it
    changes: frozenset[int]  # stamps of the ticks on which the state changes

    @property
    def seconds(self) -> float:
        return (self.sensors[-1].stamp_ns - self.sensors[0].stamp_ns) / NANOSECONDS


def prepare(bag: Path, parameters: dict[str, object]) -> Drive:
    """Read a recording and run the stages over it in the order in which it will be played."""
    pipeline = Pipeline(shipped_robot(ROBOT), DiagnosisSettings.of(parameters, "benchmark"))
    store = jazzy_typestore()
    sensors: list[Raw] = []
    answers: list[tuple[Raw, ...]] = []
    completing: dict[int, int] = {}
    changes: set[int] = set()
    with open_recording(bag) as recording:
        topics = find_topics(recording, pipeline.inputs)
        for topic, type_name, data, stamp in recording.raw_messages(topics):
            message = store.deserialize_cdr(data, type_name)
            step = pipeline.take(topics[topic], message, stamp)
            completing.update({frame.stamp_ns: len(sensors) for frame in step.frames})
            changes.update(item.stamp_ns for item in step.diagnoses if item.changed)
            sensors.append(Raw(topic, type_name, bytes(data), stamp))
            answers.append(tuple(_serialised(pipeline.messages(step))))
    return Drive(tuple(sensors), tuple(answers), completing, frozenset(changes))


def _serialised(messages: Iterable[Any]) -> Iterator[Raw]:
    for message in messages:
        name = TYPES[type(message)]
        data = jazzy_typestore().serialize_cdr(to_bag(message.plain), name)
        yield Raw(message.topic, name, bytes(data), message.stamp_ns)


def rates(messages: Sequence[Raw]) -> dict[str, float]:
    """Messages per second by topic."""
    seconds = (messages[-1].stamp_ns - messages[0].stamp_ns) / NANOSECONDS
    topics = sorted({message.topic for message in messages})
    return {t: sum(message.topic == t for message in messages) / seconds for t in topics}
