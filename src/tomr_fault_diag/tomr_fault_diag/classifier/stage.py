"""The classifier stage: residual frames in, diagnoses out at 1 Hz and at once on a change."""

from attrs import field, frozen

from tomr_fault_diag.classifier.judges import Judge, Opinion
from tomr_fault_diag.classifier.misfit import MisfitWatch
from tomr_fault_diag.classifier.observability import MotionWatch, Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.states import (
    DISOBEYS,
    NORMAL,
    NOT_OBSERVABLE,
    PUSHED,
    STALE,
    STATES,
    UNKNOWN,
    WAITING,
    State,
)
from tomr_fault_diag.residuals.frame import MOTORS, NO_COMMAND, TOTAL, ResidualFrame


@frozen
class Diagnosis:
    """What the classifier says at one tick."""

    stamp_ns: int
    state: State
    since_ns: int
    probabilities: tuple[float, ...]  # of NAMED, given all so far; empty where nothing is known
    frame: ResidualFrame
    changed: bool
    wheel: int | None = None  # 0..2 that the state concerns, where it is known
    unseen: Unseen = field(factory=Unseen)


# Whatever comes next may follow at once.
_WELL = (STATES[NORMAL], PUSHED)
_QUIET = (None, WAITING, STALE, NOT_OBSERVABLE, *_WELL)


class FaultClassifier:
    """Streaming core of the classifier; driven by stamps, the same online and offline.

    A fault is named when the judge is sure of it, normal again when it leads for `recovery_time`.
    A named fault stays named while nothing speaks against it, as when its wheel is idle. Whatever
    the judge says: a robot that does not follow its commands is called so, and what a healthy one
    could not show is unknown, not normal.
    """

    def __init__(self, judge: Judge) -> None:
        self._judge = judge
        self._motion = MotionWatch()
        self._misfits = MisfitWatch()
        self.clear()

    @property
    def settings(self) -> ClassifierSettings:
        """Of the judge as well: times may be changed while running."""
        return self._judge.settings

    @settings.setter
    def settings(self, settings: ClassifierSettings) -> None:
        self._judge.settings = settings

    def clear(self) -> None:
        """Start afresh."""
        self._judge.clear()
        self._motion.clear()
        self._misfits.clear()
        self._stamp = 0
        self._opinion: Opinion | None = None
        self._unseen = Unseen()
        self._state: State | None = None
        self._since = 0
        self._wheel: int | None = None
        self._candidate = STALE
        self._candidate_since = 0

    def classify(self, frame: ResidualFrame) -> Diagnosis | None:
        """Take a frame; returns a diagnosis when one is to be published.

        A frame that precedes the last one by more than a second starts afresh (a clock went
        back); one that merely repeats or precedes it is ignored.
        """
        if frame.stamp_ns <= self._stamp:
            if self._stamp - frame.stamp_ns < self.settings.report_period:
                return None
            self.clear()
        elapsed = frame.stamp_ns - self._stamp if self._stamp else 0
        self._stamp = frame.stamp_ns
        before = self._state
        self._decide(frame, elapsed)
        assert self._state is not None
        changed = self._state != before
        if not changed and not self._is_periodic(frame.stamp_ns, elapsed):
            return None
        shares = () if self._opinion is None else tuple(self._opinion.probabilities.tolist())
        return Diagnosis(
            frame.stamp_ns,
            self._state,
            self._since,
            shares,
            frame,
            changed,
            self._wheel,
            self._unseen,
        )

    def _is_periodic(self, stamp: int, elapsed: int) -> bool:
        """Whether a multiple of the report period lies since the last frame: no timer needed."""
        period = self.settings.report_period
        return stamp // period != (stamp - elapsed) // period

    def _decide(self, frame: ResidualFrame, elapsed: int) -> None:
        self._unseen, misfit = self._motion.take(frame), self._misfits.take(frame)
        if not _is_decidable(frame):
            self._judge.clear()
            self._opinion = None
            self._candidate = STALE
            self._enter(WAITING if _is_waiting(frame) else STALE, frame.stamp_ns, None)
            return
        if misfit.disobeys:
            # No fault of one wheel looks like this; what the judge makes of it says nothing.
            self._judge.clear()
            self._opinion = None
            self._candidate = DISOBEYS
            self._enter(DISOBEYS, frame.stamp_ns, None)
            return
        opinion = self._opinion = self._judge.judge(frame, elapsed, self._unseen)
        leading = opinion.leading
        if leading in _WELL and misfit.unexplained:
            leading = UNKNOWN
        candidate = STATES[NORMAL] if leading in _WELL else leading
        if candidate != self._candidate:
            self._candidate, self._candidate_since = candidate, frame.stamp_ns
        if leading is UNKNOWN and misfit.unexplained:
            if self._state in _QUIET:
                self._enter(UNKNOWN, frame.stamp_ns, None)
        elif leading in _WELL or (misfit.ignores_commands and self._state in _QUIET):
            self._settle(frame.stamp_ns, leading)
        elif opinion.sure and (leading != self._state or opinion.wheel != self._wheel):
            self._enter(leading, self._candidate_since, opinion.wheel)
        elif self._state is None:
            self._enter(STALE, frame.stamp_ns, None)

    def _settle(self, stamp: int, leading: State) -> None:
        """Nothing is wrong, any more or still; what that is called depends on the motion."""
        quiet = NOT_OBSERVABLE if self._unseen.everything else STATES[NORMAL]
        if leading is PUSHED:
            quiet = PUSHED
        if self._state in _QUIET:
            self._enter(quiet, stamp, None)
        elif stamp - self._candidate_since >= self.settings.recovery_time:
            self._enter(quiet, self._candidate_since, None)

    def _enter(self, state: State, since: int, wheel: int | None) -> None:
        self._wheel = wheel
        if state != self._state:
            self._state, self._since = state, since


def _is_waiting(frame: ResidualFrame) -> bool:
    """Whether all that is missing is a first command."""
    return all(frame.residuals[index].missing == NO_COMMAND for index in MOTORS)


def _is_decidable(frame: ResidualFrame) -> bool:
    """Whether any motor's power, or the total, can be compared at all."""
    return any(not frame.residuals[index].stale for index in (TOTAL, *MOTORS))
