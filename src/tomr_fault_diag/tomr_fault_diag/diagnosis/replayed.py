"""Recordings replayed in several sampling phases, one after the other or side by side."""

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import evolve, field, frozen

from tomr_fault_diag.classifier.commissioned import commissioned_words
from tomr_fault_diag.classifier.messages import diagnosis_message, evidence_of
from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import WAITING
from tomr_fault_diag.diagnosis.heard import Heard, Stream, out_of_step, rare_commands, why_undecided
from tomr_fault_diag.diagnosis.labels import Label, recorded_labels
from tomr_fault_diag.diagnosis.offline import replay
from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.diagnosis.summary import LACKING, Summariser, Summary
from tomr_fault_diag.diagnosis.track import Track, Tracker
from tomr_power_model.errors import InputError
from tomr_power_model.files import make_folder, write_text
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.outgoing import TYPES
from tomr_power_model.recordings import Recording, RecordingWriter, open_recording
from tomr_power_model.robot import Robot, load_robot

if TYPE_CHECKING:
    from tomr_fault_diag.diagnosis.score import Seen

Progress = Callable[[int], None]  # hears how much of a recording is done [ns]


@frozen
class Task:
    """One recording, and how to replay it."""

    bag: Path
    robot: str
    settings: DiagnosisSettings
    namespace: str | None = None
    phases: int = 1
    out: Path | None = None  # bag for the suite's messages, of the first phase
    page: Path | None = None  # file for its time line
    labels: tuple[Label, ...] | None = None  # what is true of it; None: nothing is known
    is_truth_recorded: bool = False  # take the labels from what a simulator recorded


@frozen
class Phase:
    """A recording diagnosed on one grid of decisions."""

    share: float  # of the period by which the grid is shifted
    summary: Summary


@frozen
class Replayed:
    """A recording diagnosed in every phase."""

    task: Task
    start_ns: int  # receive stamp of its first message
    end_ns: int
    phases: tuple[Phase, ...]
    streams: dict[str, Stream]
    notes: tuple[str, ...] = ()
    complaints: dict[tuple[str, str], int] = field(factory=dict)  # (topic, problem): messages
    undecided: str = ""  # why nothing could be decided, empty where something was
    seen: "tuple[Seen, ...]" = ()  # each phase held against the labels, where there are any

    @property
    def has_fault(self) -> bool:
        """Whether a fault was named in any phase."""
        return any(phase.summary.has_fault for phase in self.phases)


@frozen
class Failed:
    """A recording that could not be replayed, and why."""

    task: Task
    reason: str


class _Listener:
    """Gathers what one pipeline says."""

    def __init__(self, pipeline: Pipeline, detail: bool) -> None:
        self.pipeline = pipeline
        self._summariser = Summariser(pipeline.robot.wheel_names)
        self._tracker = Tracker(detail)
        self._detail = detail

    def take(self, step: Step) -> None:
        for diagnosis in step.diagnoses:
            evidence = evidence_of(self.pipeline.robot, diagnosis) if diagnosis.changed else []
            self._summariser.diagnosis(diagnosis, evidence)
            self._tracker.diagnosis(diagnosis, self._probability(diagnosis))
        for frame in step.frames:
            self._summariser.frame(frame)
            self._tracker.frame(frame)
        for report in step.reports:
            self._tracker.report(report)

    def phase(self, share: float) -> Phase:
        return Phase(share, self._summariser.summary())

    def track(self) -> Track:
        return self._tracker.track()

    def _probability(self, diagnosis: Diagnosis) -> float:
        """Of the state that stands, as its message says it."""
        if not self._detail:
            return math.nan
        status = diagnosis_message(self.pipeline.robot, diagnosis, "").statuses[0]
        return float(dict(status.values).get(f"p {diagnosis.state.name}", "nan"))


def replay_one(task: Task, progress: Progress | None = None) -> Replayed:
    """Replay a recording, score it where labels are known, and draw it. Raises InputError."""
    robot = load_robot(task.robot)
    shares = [number / task.phases for number in range(task.phases)]
    listeners = [
        _Listener(Pipeline(robot, task.settings.at_phase(share)), task.page is not None)
        for share in shares
    ]
    heard = Heard(task.settings.model.command_timeout)
    with open_recording(task.bag) as recording:
        _run(recording, task, listeners, heard, progress)
        warning, start_ns, end_ns = recording.warning, recording.start_ns, recording.end_ns
    first = listeners[0].pipeline
    phases = tuple(item.phase(share) for item, share in zip(listeners, shares, strict=True))
    complaints, undecided, clocks = first.complaints.counts, "", out_of_step(heard)
    # Commands that come too late for their ticks leave the robot waiting for them.
    lacking = LACKING | {WAITING.name} if clocks else LACKING
    if not any(phase.summary.is_decided(lacking) for phase in phases):
        wanted = [item.topic for item in first.inputs]
        undecided = why_undecided(heard, wanted, complaints, phases[0].summary)
    said = warning, _outdated(task, robot), *first.misdescribed(), rare_commands(heard)
    notes = tuple(filter(None, (*said, "" if undecided else clocks)))
    for stream in heard.streams.values():
        stream.first = stream.last = None  # messages need not travel between processes
    found = Replayed(task, start_ns, end_ns, phases, heard.streams, notes, complaints, undecided)
    return _finished(found, robot, [listener.track() for listener in listeners])


def _outdated(task: Task, robot: Robot) -> str:
    """A line where bands and caution were set for something else; empty where not."""
    settings = task.settings.classifier
    said = commissioned_words(settings, robot)
    return f"commissioned: {said}" if settings.commissioned and said.startswith("no") else ""


def _finished(found: Replayed, robot: Robot, tracks: Sequence[Track]) -> Replayed:
    """Score and draw in the process that holds the tracks: they are large."""
    task, labels = found.task, found.task.labels
    if task.is_truth_recorded:
        labels = recorded_labels(task.bag, task.namespace)
    if labels is not None:
        from tomr_fault_diag.diagnosis.score import seen  # scipy takes its time to load

        count = len(tracks)
        found = evolve(
            found,
            seen=tuple(
                seen(track, found.start_ns, labels, (number, count))
                for number, track in enumerate(tracks)
            ),
        )
    if task.page is not None:
        from tomr_fault_diag.diagnosis.page import time_line

        text = time_line(found, tracks, labels or (), robot.wheel_topics)
        write_page(task.page, text)
    return found


def _run(
    recording: Recording,
    task: Task,
    listeners: Sequence[_Listener],
    heard: Heard,
    progress: Progress | None,
) -> None:
    pipelines = [listener.pipeline for listener in listeners]
    with ExitStack() as stack:
        writer = stack.enter_context(RecordingWriter(task.out)) if task.out else None
        for receive_ns, steps in replay(recording, pipelines, task.namespace, heard.note):
            for listener, step in zip(listeners, steps, strict=True):
                if step.frames:
                    listener.take(step)
            step = steps[0]
            if not step.frames and not step.predictions:
                continue
            if progress is not None:
                progress(receive_ns - recording.start_ns)
            if writer is not None:
                for message in pipelines[0].messages(step):
                    writer.write(
                        message.topic, TYPES[type(message)], to_bag(message.plain), message.stamp_ns
                    )


def pages_for(folder: Path, bags: Sequence[Path]) -> list[Path]:
    """A file for each recording, named as it is; a number where two have one name."""
    taken: dict[str, int] = {}
    found = []
    for bag in bags:
        stem = bag.stem if bag.suffix else bag.name
        taken[stem] = taken.get(stem, 0) + 1
        number = f"_{taken[stem]}" if taken[stem] > 1 else ""
        found.append(folder / f"{stem}{number}.html")
    return found


def write_page(path: Path, text: str) -> None:
    """Write a page. Raises InputError."""
    make_folder(path.parent)
    write_text(path, text)


def replay_all(tasks: Sequence[Task], jobs: int) -> Iterator[Replayed | Failed]:
    """Replay recordings in so many processes, in the order in which they are done."""
    with ProcessPoolExecutor(min(jobs, len(tasks))) as pool:
        waiting: dict[Future[Replayed | Failed], Task] = {
            pool.submit(_guarded, task): task for task in tasks
        }
        for done in as_completed(waiting):
            try:
                yield done.result()
            except BrokenProcessPool:
                yield Failed(waiting[done], "its process ended: is there enough memory?")


def _guarded(task: Task) -> Replayed | Failed:
    try:
        return replay_one(task)
    except InputError as error:
        return Failed(task, str(error))
