"""What the classifier itself holds against a healthy robot, tick by tick, in decades.

The evidence is the log odds of the likeliest fault against normal without the prior: how many
decades of `caution` a tick would have overcome. It is read off the classifier in use, run with the
most caution there is, so that it follows whatever the classifier becomes.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.evidence import ALONE, Beside
from tomr_fault_diag.classifier.judges import Opinion, WindowJudge, make_judge
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import CLASSIFIER_PARAMETERS, ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import FAULTLESS, State
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

MOST_CAUTION = next(spec.maximum for spec in CLASSIFIER_PARAMETERS if spec.name == "caution")
SURE = 2.0  # decades beyond the caution at which a fault is named: odds of a hundred to one


class _Witness(WindowJudge):
    """A judge of most caution that remembers its evidence of the newest tick it was shown."""

    def __init__(self, settings: ClassifierSettings) -> None:
        super().__init__(
            WindowNetwork.load(settings.weights), evolve(settings, caution=MOST_CAUTION)
        )
        self.newest = 0.0

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        opinion = super().judge(frame, elapsed_ns, unseen, beside)
        self.newest = self.evidence()
        return opinion


def evidence_in(
    frames: Iterable[ResidualFrame], settings: ClassifierSettings, robot: Robot
) -> Array:
    """Decades of evidence for a fault at each tick, 0 where nothing could be decided, (n,)."""
    return witnessed(frames, settings, robot)[0]


def witnessed(
    frames: Iterable[ResidualFrame], settings: ClassifierSettings, robot: Robot
) -> tuple[Array, float]:
    """The same, and the most that small faults that last gathered [nats]."""
    witness = _Witness(settings)
    classifier = FaultClassifier.around(witness, robot)
    found, most = [], 0.0
    for frame in frames:
        witness.newest = 0.0
        classifier.classify(frame)
        found.append(witness.newest)
        most = max(most, witness.gathered)
    return np.array(found), most


@frozen
class Episode:
    """A stretch of one state that is not faultless; times in s after the first frame."""

    state: str
    wheel: int | None  # 0..2
    begin: float
    end: float


@frozen
class Decided:
    """What a diagnosis says of a drive."""

    ticks: int
    undecided: int  # ticks that are stale or not observable
    alarms: tuple[Episode, ...]


def together(said: Sequence[Decided]) -> Decided:
    """What is said of several drives; each alarm keeps the times of its own."""
    return Decided(
        sum(one.ticks for one in said),
        sum(one.undecided for one in said),
        tuple(alarm for one in said for alarm in one.alarms),
    )


def decisions(frames: list[ResidualFrame], settings: ClassifierSettings, robot: Robot) -> Decided:
    """Diagnose frames of a described robot with a classifier of given settings."""
    alarms: list[Episode] = []
    undecided = 0
    for at, state, begun in _said(frames, settings, robot):
        if begun is not None:
            alarms.append(begun)
        if state is None or state.name in _QUIET:
            undecided += 1
        elif state.name not in FAULTLESS:
            alarms[-1] = evolve(alarms[-1], end=at)
    return Decided(len(frames), undecided, tuple(alarms))


def first_alarm(
    frames: list[ResidualFrame], settings: ClassifierSettings, robot: Robot, begin: float
) -> Episode | None:
    """The first alarm that begins at a time [s] or later; frames after it are not looked at."""
    for _, _, begun in _said(frames, settings, robot):
        if begun is not None and begun.begin >= begin:
            return begun
    return None


def _said(
    frames: list[ResidualFrame], settings: ClassifierSettings, robot: Robot
) -> Iterator[tuple[float, State | None, Episode | None]]:
    """Time of each frame [s], the state that holds, and an alarm that begins."""
    classifier = FaultClassifier.around(make_judge(settings), robot)
    current: Diagnosis | None = None
    for frame in frames:
        at = (frame.stamp_ns - frames[0].stamp_ns) / NANOSECONDS
        said, begun = classifier.classify(frame), None
        if said is not None and (
            current is None or (said.state, said.wheel) != (current.state, current.wheel)
        ):
            current = said
            if said.state.name not in FAULTLESS:
                begun = Episode(said.state.name, said.wheel, at, at)
        yield at, None if current is None else current.state, begun


_QUIET = FAULTLESS - {"normal"}
