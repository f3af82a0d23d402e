"""The classifier stage: residual frames in, diagnoses out at 1 Hz and at once on a change."""

from typing import Self

from attrs import evolve, field, frozen

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_fault_diag.classifier.contacts import NOTHING
from tomr_fault_diag.classifier.evidence import Beside
from tomr_fault_diag.classifier.judges import Judge, Opinion, make_judge
from tomr_fault_diag.classifier.lasting import LastingWatch
from tomr_fault_diag.classifier.misfit import Misfit, MisfitWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import MotionWatch, Unseen
from tomr_fault_diag.classifier.outside import NOTHING_ACTS, Outside, OutsideWatch
from tomr_fault_diag.classifier.parity import NOT_KNOWN, ParityWatch
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.severity import Severity, SeverityWatch
from tomr_fault_diag.classifier.slides import SlideWatch
from tomr_fault_diag.classifier.slope import SlopeFilter
from tomr_fault_diag.classifier.states import (
    BURDENED,
    DISOBEYS,
    LOW_SUPPLY,
    NORMAL,
    NOT_ENOUGH,
    NOT_OBSERVABLE,
    POWER_SENSOR,
    PUSHED,
    SLIP,
    STALE,
    STATES,
    UNKNOWN,
    WAITING,
    State,
)
from tomr_fault_diag.classifier.sufficiency import Sufficiency, SufficiencyWatch
from tomr_fault_diag.residuals.frame import GAP, MOTORS, NO_COMMAND, ResidualFrame
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot


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
    usable: bool = True  # whether this tick held data to decide by
    severity: Severity | None = None  # how bad it is, once that is known
    conditions: tuple[Severity, ...] = ()  # what has changed slowly, and is no fault


# Whatever comes next may follow at once.
_WELL = (STATES[NORMAL], PUSHED)
# What shows only now and then, as when a wheel has to push.
_ELUSIVE = (STATES[SLIP], BURDENED, UNKNOWN)
_QUIET = (None, WAITING, STALE, NOT_ENOUGH, NOT_OBSERVABLE, *_WELL, *POWER_SENSOR)
_WENT_BACK = to_ns(1.0)  # further than messages overtake each other
# Where commands that are another's may be told: beside a fault of a motor its wheel strays anyway.
_WITHOUT_FAULT = (*_QUIET, DISOBEYS, UNKNOWN)


class FaultClassifier:
    """Streaming core of the classifier; driven by stamps, the same online and offline.

    A fault is named when the judge is sure of it, normal again when it leads for `recovery_time`.
    A named fault stays named while nothing speaks against it, as when its wheel is idle, and while
    the robot stands, whose windows all say the same. Whatever the judge says: a robot that does not
    follow its commands is called so, and what a healthy one could not show is unknown, not normal.
    Where data are missing nothing is concluded.
    """

    def __init__(
        self,
        judge: Judge,
        severity: SeverityWatch | None = None,
        *,
        slides: SlideWatch | None = None,
        outside: OutsideWatch | None = None,
        slope: SlopeFilter | None = None,
        lasting: LastingWatch | None = None,
        misfits: MisfitWatch | None = None,
        parity: ParityWatch | None = None,
    ) -> None:
        """Without `severity` it is not stated how bad a fault is, nor what has changed slowly;
        without `slides` residuals alone show a slip, without `outside` a load; without `slope` what
        an accelerometer feels of one stays in the residuals; without `lasting`
        small faults are not looked for; without `misfits` it is not known what a motor draws that
        is not driven, without `parity` whether it draws what goes with its voltage and speed."""
        self._judge = judge
        self._lasting = lasting
        self._severity = severity
        self._slides = slides
        self._outside = outside
        self._slope = slope
        self._motion = MotionWatch()
        self._misfits = misfits or MisfitWatch()
        self._parity = parity
        self._data = SufficiencyWatch()
        self.clear()

    @classmethod
    def of(cls, settings: ClassifierSettings, robot: Robot) -> Self:
        """With all that a described robot allows; raises InputError for weights that do not fit."""
        return cls.around(make_judge(settings), robot, SeverityWatch(robot))

    @classmethod
    def around(cls, judge: Judge, robot: Robot, severity: SeverityWatch | None = None) -> Self:
        """A judge, and what contacts and, where they are looked for, small faults show beside."""
        return cls(
            judge,
            severity,
            slides=SlideWatch(robot),
            outside=OutsideWatch(robot),
            slope=SlopeFilter(robot),
            lasting=LastingWatch(robot) if judge.settings.small_faults else None,
            misfits=MisfitWatch(Motors(robot).idle.tolist(), BrakingWatch(robot)),
            parity=ParityWatch(robot),
        )

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
        self._data.clear()
        if self._severity is not None:
            self._severity.clear()
        if self._slides is not None:
            self._slides.clear()
        if self._outside is not None:
            self._outside.clear()
        if self._lasting is not None:
            self._lasting.clear()
        if self._parity is not None:
            self._parity.clear()
        self._stamp = 0
        self._opinion: Opinion | None = None
        self._unseen = Unseen()
        self._contacts, self._acts = NOTHING, NOTHING_ACTS
        self._usable = True
        self._state: State | None = None
        self._since = 0
        self._wheel: int | None = None
        self._candidate = STALE
        self._candidate_since = 0
        self._sure_since: int | None = None

    def release(self) -> str:
        """Let go of a named fault, latched or not; what still holds is named anew. Returns it."""
        named = "" if self._state is None or self._state in _QUIET else self._state.name
        if named:
            self._state = None
        return named

    def classify(self, frame: ResidualFrame) -> Diagnosis | None:
        """Take a frame; returns a diagnosis when one is to be published.

        A frame that precedes the last one by more than a second starts afresh (a clock went
        back); one that merely repeats or precedes it is ignored.
        """
        if frame.stamp_ns <= self._stamp:
            if self._stamp - frame.stamp_ns < _WENT_BACK:
                return None
            self.clear()
        elapsed = frame.stamp_ns - self._stamp if self._stamp else 0
        self._stamp = frame.stamp_ns
        before = self._state
        level = self._leveled(frame)
        self._decide(frame, level, elapsed)
        assert self._state is not None
        if self._severity is not None:
            self._severity.take(level, self._state, self._wheel)
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
            self._usable,
            self._how_bad(),
            () if self._severity is None else self._severity.conditions,
        )

    def _how_bad(self) -> Severity | None:
        if self._severity is None or self._state is None:
            return None
        return self._severity.severity(self._state, self._wheel)

    def _is_periodic(self, stamp: int, elapsed: int) -> bool:
        """Whether a multiple of the report period lies since the last frame: no timer needed."""
        period = self.settings.report_period
        return stamp // period != (stamp - elapsed) // period

    def _leveled(self, frame: ResidualFrame) -> ResidualFrame:
        """Look at what contacts and the body show of a frame; the same on a level floor."""
        self._contacts = NOTHING if self._slides is None else self._slides.take(frame)
        self._acts = NOTHING_ACTS if self._outside is None else self._outside.take(frame)
        return frame if self._slope is None else self._slope.without(frame, self._contacts)

    def _decide(self, raw: ResidualFrame, frame: ResidualFrame, elapsed: int) -> None:
        """Look at a frame, if there is something in it, and name a state. `raw`: on what floor it
        may be, for small faults, which a share of a slope that is left would look like."""
        data = self._data.take(frame)
        self._unseen = evolve(self._motion.take(frame), blind=data.blind)
        contacts, outside = self._contacts, self._acts
        if contacts.force:
            outside = evolve(outside, load=False, may_be_push=True)
        misfit, self._usable = self._misfits.take(frame, self.settings.low_supply), data.usable
        if not data.usable:
            self._pause(frame, data)
            return
        if not data.joined:
            self._judge.interrupt()
            self._candidate_since = frame.stamp_ns
        if frame.mistake and data.enough:
            self._conclude(UNKNOWN, frame.stamp_ns)
            return
        obeys_others = misfit.obeys_others and self._state in _WITHOUT_FAULT
        if (misfit.disobeys or obeys_others) and data.enough:
            self._conclude(DISOBEYS, frame.stamp_ns)
            return
        is_well = self._state is STATES[NORMAL]
        parity = NOT_KNOWN if self._parity is None else self._parity.take(frame)
        beside = Beside(contacts, outside, parity=parity)
        if self._lasting is not None:
            beside = evolve(beside, lasting=self._lasting.take(raw, is_well))
        self._opinion = self._judge.judge(frame, elapsed, self._unseen, beside)
        if data.enough or self._state not in _QUIET:
            self._weigh(self._opinion, misfit, frame.stamp_ns, outside)
        else:
            self._enter(NOT_ENOUGH, frame.stamp_ns, None)

    def _conclude(self, state: State, stamp: int) -> None:
        """No fault of one wheel looks like this; what the judge makes of it says nothing."""
        self._judge.clear()
        self._opinion = None
        self._candidate = state
        self._enter(state, stamp, None)

    def _weigh(self, opinion: Opinion, misfit: Misfit, stamp: int, outside: Outside) -> None:
        """Name what the judge is sure of, or what it does not know."""
        leading = self._leading(opinion, misfit, outside)
        candidate = STATES[NORMAL] if leading in _WELL else leading
        if not _is_one_fault(candidate, self._candidate):
            self._candidate_since, self._sure_since = stamp, None
        self._candidate = candidate
        held = self._is_held(opinion.sure, stamp)
        is_blind = opinion.wheel in [wheel for wheel, _ in self._unseen.blind]
        if leading is UNKNOWN and misfit.unexplained:
            if self._state in _QUIET:
                self._enter(UNKNOWN, stamp, None)
        elif leading is LOW_SUPPLY:
            if self._state in _QUIET or self._is_over(stamp):
                self._enter(LOW_SUPPLY, stamp, None)
        elif leading in _WELL or ((misfit.ignores_commands or is_blind) and self._state in _QUIET):
            self._settle(stamp, leading)
        elif held and not is_blind and self._may_name(leading, opinion.wheel):
            self._enter(leading, self._candidate_since, opinion.wheel)
        elif self._state is None:
            self._enter(STALE, stamp, None)

    def _leading(self, opinion: Opinion, misfit: Misfit, outside: Outside) -> State:
        """What leads; what a push or a slope may explain is not unknown."""
        if self._state not in _QUIET and self._state is not UNKNOWN:
            return _called(opinion, misfit)
        if opinion.leading is PUSHED and self._contacts.hides_slopes:
            misfit = evolve(misfit, unexplained=misfit.stays_so)  # a slope may have begun
        leading = _called(opinion, misfit)
        is_pushed = leading is UNKNOWN and self._may_be_pushed(opinion, outside)
        return PUSHED if is_pushed else leading

    def _may_be_pushed(self, opinion: Opinion, outside: Outside) -> bool:
        """Whether somebody who leans on the robot, or a slope, explains what is far off."""
        is_well, hidden = opinion.leading in _WELL, self._contacts.hides_slopes
        may_be_slope = opinion.leading is PUSHED or (is_well and hidden)
        looks_so = may_be_slope and outside.fits_slope
        is_felt = is_well and outside.fits_felt
        # Where nothing feels a slope, it need not be known which explains it.
        slopes = self._contacts.slopes and hidden
        return outside.may_be_push or looks_so or is_felt or slopes

    def _may_name(self, leading: State, wheel: int | None) -> bool:
        """Whether it is something new; a robot that stands shows no other fault than it had."""
        if self._unseen.everything and self._state not in _QUIET:
            return False
        return leading != self._state or wheel != self._wheel

    def _is_held(self, sure: bool, stamp: int) -> bool:
        """Whether the judge has been sure of what leads for `raise_time`."""
        if not sure:
            self._sure_since = None
            return False
        if self._sure_since is None:
            self._sure_since = stamp
        return stamp - self._sure_since >= self.settings.raise_time

    def _pause(self, frame: ResidualFrame, data: Sufficiency) -> None:
        """Nothing can be said of a frame: what was named stays, but normal not for long."""
        self._opinion = None
        if self._state is not None and (data.enough or self._state not in _QUIET):
            return
        if _is_waiting(frame):
            self._enter(WAITING, frame.stamp_ns, None)
        elif any(item.missing.startswith(GAP) for item in frame.residuals):
            self._enter(NOT_ENOUGH, frame.stamp_ns, None)
        else:
            self._enter(STALE, frame.stamp_ns, None)

    def _settle(self, stamp: int, leading: State) -> None:
        """Nothing is wrong, any more or still; what that is called depends on the motion."""
        quiet = NOT_OBSERVABLE if self._unseen.everything else STATES[NORMAL]
        if leading is PUSHED:
            quiet = PUSHED
        ailing = [wheel for wheel, reason in self._unseen.blind if reason]
        if ailing:
            quiet = POWER_SENSOR[ailing[0]]
        if self._state in _QUIET:
            self._enter(quiet, stamp, None)
        elif self._is_over(stamp):
            self._enter(quiet, self._candidate_since, None)

    def _is_over(self, stamp: int) -> bool:
        """Whether something else has led for so long that what is named may be let go."""
        settings = self.settings
        elusive = self._state in _ELUSIVE
        recovery = settings.slip_recovery_time if elusive else settings.recovery_time
        return not settings.latch and stamp - self._candidate_since >= recovery

    def _enter(self, state: State, since: int, wheel: int | None) -> None:
        self._wheel = wheel
        if state != self._state:
            self._state, self._since = state, since


def _called(opinion: Opinion, misfit: Misfit) -> State:
    """What leads: as the judge has it, and what it cannot know."""
    leading = opinion.leading
    if leading is PUSHED and (misfit.ignores_commands or not opinion.sure):
        leading = STATES[NORMAL]  # a fault that begins may look like a push at first
    if misfit.low_supply and (leading in _WELL or not opinion.sure):
        return LOW_SUPPLY
    is_named = opinion.sure and leading not in _WELL
    return UNKNOWN if misfit.unexplained and not is_named else leading


def _is_one_fault(state: State, other: State) -> bool:
    """Whether two states are the same, or state what ails one and the same motor."""
    return state == other or (state.paper is not None and state.paper == other.paper)


def _is_waiting(frame: ResidualFrame) -> bool:
    """Whether all that is missing is a first command."""
    return all(frame.residuals[index].missing == NO_COMMAND for index in MOTORS)
