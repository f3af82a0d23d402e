"""A recording as pictures: diagnosed anew, ten pictures per second of it."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from tomr_fault_diag.diagnosis.labels import TRUTH_TOPIC
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import STAGE_NODES, DiagnosisSettings
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.recordings import Recording, open_recording, resolve_topic
from tomr_power_model.robot import Robot, load_robot, read_node_sections
from tomr_view.picture import PICTURE_PERIOD, Gatherer, Json, Status, described, spells


def pictures_of(
    bag: Path, robot_file: str, namespace: str | None = None
) -> tuple[Robot, list[Json]]:
    """The robot and the pictures of a whole recording; raises InputError as tomr_diagnose does."""
    robot = load_robot(robot_file)
    settings = DiagnosisSettings.of(read_node_sections(robot_file, STAGE_NODES), robot_file)
    with open_recording(bag) as recording:
        pipeline = Pipeline(robot, settings)
        return robot, list(_pictures(recording, pipeline, namespace))


def introduction(robot: Robot, pictures: Sequence[Json], title: str) -> Json:
    """What a page learns of a recording before its pictures."""
    return {
        "mode": "recording",
        "title": title,
        "robot": described(robot),
        "count": len(pictures),
        "times": [picture["t"] for picture in pictures],
        "spells": spells(pictures),
    }


def _pictures(recording: Recording, pipeline: Pipeline, namespace: str | None) -> Iterator[Json]:
    gatherer = Gatherer(pipeline.robot)
    truth = _Truth(recording, namespace)
    shown = -1
    for receive_ns, step in diagnose(recording, pipeline, namespace):
        for message in pipeline.messages(step):
            if isinstance(message, DiagnosticMessage) and message.topic == "/diagnostics":
                gatherer.diagnosis(
                    Status(item.name, int(item.level), item.message, dict(item.values))
                    for item in message.statuses
                )
        truth.hand_on(gatherer, receive_ns)
        for frame in step.frames:
            gatherer.residuals(frame)
            if frame.stamp_ns // PICTURE_PERIOD != shown:
                shown = frame.stamp_ns // PICTURE_PERIOD
                picture = gatherer.picture()
                assert picture is not None
                yield picture


class _Truth:
    """A simulator's word on its faults, as far as it was recorded."""

    def __init__(self, recording: Recording, namespace: str | None) -> None:
        topic = resolve_topic(recording, TRUTH_TOPIC, namespace)
        self._messages = iter(recording.messages([topic]) if topic else ())
        self._next = next(self._messages, None)

    def hand_on(self, gatherer: Gatherer, receive_ns: int) -> None:
        """Hand on what was received up to then."""
        while self._next is not None and self._next[3] <= receive_ns:
            statuses = map(Status.of_message, self._next[2].status)
            gatherer.truth(statuses, self._next[3])
            self._next = next(self._messages, None)
