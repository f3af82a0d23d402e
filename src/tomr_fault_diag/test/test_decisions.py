"""When a fault is named and let go of, and what a motor's own data have to do with it."""

import math
from collections.abc import Sequence
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier import states
from tomr_fault_diag.classifier.advice import check_first
from tomr_fault_diag.classifier.belief import CONTROLS, DRAGS, HYPOTHESES
from tomr_fault_diag.classifier.belief import ENCODERS as LOST_ENCODERS
from tomr_fault_diag.classifier.evidence import ALONE, Beside
from tomr_fault_diag.classifier.judges import Opinion, WindowJudge, make_judge
from tomr_fault_diag.classifier.messages import diagnosis_message, six_state
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import (
    BURDENED,
    CONTROL,
    DEGRADED,
    DRAGGING,
    MOTOR,
    NORMAL,
    POWER_SENSOR,
    PUSHED,
    SLIP,
    STATES,
    STUCK,
    UNKNOWN,
    State,
)
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    FROZEN,
    GAP,
    MOTORS,
    NO_COMMAND,
    SCATTER,
    SPEEDS,
    TOTAL,
    Residual,
    ResidualFrame,
)
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN = float("nan")
TURNING = (3.0, -8.0, 5.0)
# Encoder of wheel 2 lost: it reads standstill while its motor draws more and more.
LOST = {
    TOTAL: 38.0, MOTORS[1]: 30.0, ENCODERS[1]: 32.0, SPEEDS[1]: -8.0, MOTORS[0]: 4.0,
    MOTORS[2]: 4.0, ENCODERS[0]: 4.0, ENCODERS[2]: 4.0, SPEEDS[0]: 0.1, SPEEDS[2]: 0.1,
}  # fmt: skip


def frame(at_ms: int, off: dict[int, float] | None = None) -> ResidualFrame:
    """All as modelled but for some residuals [W or rad/s]."""
    found = []
    for index in range(10):
        value = (off or {}).get(index, 0.0)
        if index in SPEEDS:
            found.append(Residual(value, 0.2, TURNING[index - SPEEDS[0]], "rad/s"))
        else:
            found.append(Residual(value, 2.0, 2.0))
    return ResidualFrame(BASE + at_ms * MS, tuple(found))


def without(given: ResidualFrame, places: Sequence[int], why: str) -> ResidualFrame:
    """The same without some residuals."""
    return evolve(
        given,
        residuals=tuple(
            evolve(item, residual=NAN, missing=why) if index in places else item
            for index, item in enumerate(given.residuals)
        ),
    )


def ticks(start: int, end: int, off: dict[int, float] | None = None) -> list[ResidualFrame]:
    return [frame(t, off) for t in range(start, end, 50)]


def at_rest(start: int, end: int) -> list[ResidualFrame]:
    """Nothing is asked of the wheels, and they stand."""

    def still(given: ResidualFrame) -> ResidualFrame:
        stopped = [
            evolve(item, modelled=0.0) if index in SPEEDS else item
            for index, item in enumerate(given.residuals)
        ]
        return evolve(given, residuals=tuple(stopped))

    return [still(item) for item in ticks(start, end)]


def classified(frames: Sequence[ResidualFrame], **settings: Any) -> list[Diagnosis]:
    classifier = FaultClassifier(make_judge(ClassifierSettings(**settings)))
    found = [classifier.classify(item) for item in frames]
    return [diagnosis for diagnosis in found if diagnosis is not None]


def changes(found: Sequence[Diagnosis]) -> list[tuple[int, str]]:
    """When the state changed, and to what: a push is normal."""
    named: list[tuple[int, str]] = []
    for diagnosis in found:
        name = (STATES[NORMAL] if diagnosis.state is PUSHED else diagnosis.state).name
        if diagnosis.changed and name != (named[-1][1] if named else ""):
            named.append(((diagnosis.stamp_ns - BASE) // MS, name))
    return named


FAULT = "motor system fault 2"
FAULTY = [*ticks(50, 2000), *ticks(2000, 4000, LOST)]


def test_a_fault_is_named_at_once_or_after_its_hold_time() -> None:
    (_, (at, name)) = changes(classified(FAULTY))
    assert name == FAULT
    assert at < 2400
    (_, (later, name)) = changes(classified(FAULTY, raise_time=to_ns(0.5)))
    assert (later, name) == (at + 500, FAULT)
    assert len(changes(classified(FAULTY, raise_time=to_ns(3.0)))) == 1


def test_a_latched_fault_stays_until_it_is_released() -> None:
    classifier = FaultClassifier(make_judge(ClassifierSettings(latch=True)))
    found = [classifier.classify(item) for item in [*FAULTY, *ticks(4000, 8000)]]
    assert changes([d for d in found if d is not None])[-1][1] == FAULT
    assert classifier.release() == FAULT
    after = [classifier.classify(item) for item in ticks(8000, 9000)]
    assert changes([d for d in after if d is not None]) == [(8000, "normal")]
    assert classifier.release() == ""


def test_a_released_fault_that_is_still_there_is_named_anew() -> None:
    classifier = FaultClassifier(make_judge(ClassifierSettings(latch=True)))
    for item in FAULTY:
        classifier.classify(item)
    classifier.release()
    diagnosis = classifier.classify(frame(4000, LOST))
    assert diagnosis is not None
    assert diagnosis.state.name == FAULT


@pytest.mark.parametrize(
    ("missing", "ails"),
    [("no fresh wheel_2/power", "dead"), (f"wheel_2/power{FROZEN}", "frozen")],
)
def test_no_motor_is_accused_without_data_of_its_own(missing: str, ails: str) -> None:
    drive = [*FAULTY, *ticks(4000, 5000, LOST)]
    blind = [without(f, [MOTORS[1], ENCODERS[1]], missing) for f in drive]
    found = classified(blind)
    assert FAULT not in {d.state.name for d in found}
    (last,) = [d for d in found if d.state is POWER_SENSOR[1]][-1:]
    status = diagnosis_message(shipped_robot("reference"), last, "").statuses[0]
    assert f"not observable: motor 2 (power sensor {ails})" in status.message
    assert f"motor 2 (power sensor {ails})" in dict(status.values)["not_observable"]


def test_a_dropout_of_a_second_is_no_fault_of_a_sensor() -> None:
    dead = [*MOTORS, *ENCODERS]
    silent = [without(item, dead, "no fresh power") for item in ticks(2000, 3000)]
    frames = [*ticks(50, 2000), *silent, *ticks(3000, 5000)]
    assert [name for _, name in changes(classified(frames))] == ["normal"]


@pytest.mark.parametrize(
    ("missing", "within"),
    [("no fresh wheel_2/power", (1500, 1600)), (f"wheel_2/power{FROZEN}", (1000, 1100))],
)
def test_a_sensor_is_to_blame_once_no_dropout_explains_it(
    missing: str, within: tuple[int, int]
) -> None:
    blind = [without(f, [MOTORS[1], ENCODERS[1]], missing) for f in ticks(2000, 5000)]
    (_, (at, name)) = changes(classified([*ticks(50, 2000), *blind]))
    assert name == POWER_SENSOR[1].name
    assert within[0] <= at - 2000 <= within[1]


def test_bad_stamps_are_no_fault_of_a_sensor() -> None:
    odd = f"{GAP}wheel_2/power: its stamps do not fit"
    blind = [without(f, [MOTORS[1], ENCODERS[1]], odd) for f in ticks(2000, 9000)]
    found = classified([*ticks(50, 2000), *blind])
    assert [name for _, name in changes(found)] == ["normal"]
    status = diagnosis_message(shipped_robot("reference"), found[-1], "").statuses[0]
    assert "motor 2" in dict(status.values)["not_observable"]


def test_a_fault_named_before_stays_while_its_sensor_is_dead() -> None:
    blind = [
        without(f, [MOTORS[1], ENCODERS[1]], "no fresh wheel_2/power") for f in ticks(4000, 9000)
    ]
    assert changes(classified([*FAULTY, *blind]))[-1][1] == FAULT


def test_a_gap_changes_nothing_and_the_fault_is_found_after_it() -> None:
    def gap(frames: list[ResidualFrame]) -> list[ResidualFrame]:
        return [without(f, [*SPEEDS, *ENCODERS], f"{GAP}joint_states") for f in frames]

    healthy = [*ticks(50, 2000), *gap(ticks(2000, 2300, LOST)), *ticks(2300, 4000)]
    assert [name for _, name in changes(classified(healthy))] == ["normal"]
    # It came in the gap: named as soon as the window is full again, and not before.
    came = [*ticks(50, 2000), *gap(ticks(2000, 2300, LOST)), *ticks(2300, 4000, LOST)]
    (_, (at, name)) = changes(classified(came))
    assert name == FAULT
    assert 2300 + 350 <= at <= 2300 + 800
    # A fault that was named is not cleared by a gap, however long.
    named = [*FAULTY, *gap(ticks(4000, 9000)), *ticks(9000, 9900)]
    assert [name for _, name in changes(classified(named))] == ["normal", FAULT]


@pytest.mark.parametrize("report_period", [0.05, 1.0, 60.0])
def test_frames_that_go_back_by_more_than_a_second_start_afresh(report_period: float) -> None:
    """Those that come a little late change nothing, however often is said how it is."""
    late = [*FAULTY[:60], FAULTY[50], *FAULTY[60:]]
    settings = {"report_period": to_ns(report_period)}
    assert changes(classified(late, **settings)) == changes(classified(FAULTY, **settings))
    looped = classified([*FAULTY, *ticks(50, 2000)], **settings)
    assert changes(looped)[-1][1] == "normal"


def test_too_many_gaps_are_not_enough_data() -> None:
    frames = []
    for t in range(50, 6000, 50):
        broken = t > 2000 and t % 400 < 300
        frames.append(without(frame(t), SPEEDS, f"{GAP}joint_states") if broken else frame(t))
    found = classified(frames)
    assert [name for _, name in changes(found)] == ["normal", "not enough data"]
    assert not any(d.probabilities for d in found if not d.usable)
    said = {
        diagnosis_message(shipped_robot("reference"), d, "").statuses[0].message
        for d in classified(frames, report_period=0.05)
        if d.state is states.NOT_ENOUGH
    }
    assert said == {
        "not enough data: a gap in joint_states",
        "not enough data: gaps a moment ago",
    }


def test_speeds_that_cannot_be_measured_leave_the_powers() -> None:
    """Something is wrong with motor 2, and without its speed nobody can say what."""
    frames = [without(item, SPEEDS, SCATTER) for item in FAULTY]
    assert changes(classified(frames)) == [(50, "normal"), (3000, "unknown")]


def test_commands_that_pause_are_waited_for_after_a_while() -> None:
    quiet = [
        evolve(item, residuals=(Residual(NAN, NAN, NAN, missing=NO_COMMAND),) * 10)
        for item in ticks(2000, 5000)
    ]
    found = changes(classified([*ticks(50, 2000), *quiet]))
    assert [name for _, name in found] == ["normal", "waiting"]
    assert 2400 <= found[1][0] <= 2600


@pytest.mark.parametrize("hz", [5, 10, 20, 40, 100])
@pytest.mark.parametrize("phase", [0, 7, 21, 43])
def test_states_do_not_hang_on_rate_or_phase(hz: int, phase: int) -> None:
    """In the frames of a fault that comes and goes; phases in milliseconds."""
    period = 1000 // hz

    def at(t: int) -> ResidualFrame:
        return frame(t, LOST if 3000 < t <= 6000 else None)

    found = changes(classified([at(t) for t in range(period + phase, 9000, period)]))
    assert [name for _, name in found] == ["normal", FAULT, "normal"]
    assert found[1][0] - 3000 <= 250 + 2 * period
    assert found[2][0] - 6000 <= 1600 + 2 * period


def test_a_gap_is_no_time_in_which_a_fault_recovers() -> None:
    healthy = [*ticks(4000, 4900), *ticks(8000, 10_000)]
    found = changes(classified([*FAULTY, *healthy]))
    assert [name for _, name in found] == ["normal", FAULT, "normal"]
    assert found[-1][0] >= 8000 + 500


def test_every_state_that_is_wrong_says_what_to_check_and_which_of_the_six_it_is() -> None:
    named = [value for value in vars(states).values() if isinstance(value, State)]
    for state in (*STATES, *POWER_SENSOR, *named):
        is_worth_a_look = state.level is not Level.OK or state is states.NOT_ENOUGH
        assert bool(check_first(state)) == is_worth_a_look, state
        paper = "unknown" if state.paper is None else STATES[state.paper].name
        assert six_state(state) == paper
    found = next(d for d in classified(FAULTY) if d.changed and d.state is STATES[MOTOR + 1])
    values = dict(diagnosis_message(shipped_robot("reference"), found, "").statuses[0].values)
    assert values["six_state"] == FAULT
    assert values["check_first"].startswith("the encoder's plug")


class Fixed:
    """A judge that is sure of one wheel, whatever it sees."""

    def __init__(self, **settings: Any) -> None:
        self.settings = ClassifierSettings(**settings)

    wheel = 0

    def clear(self) -> None: ...

    def interrupt(self) -> None: ...

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        return Opinion(np.eye(6)[MOTOR + self.wheel], sure=True, wheel=self.wheel)


def test_small_faults_alone_are_looked_for_in_what_a_slope_is_still_in() -> None:
    """Of a slope that is taken out a tenth may be left, which would look like one."""
    judge, severity, lasting, slope = Mock(wraps=Fixed()), Mock(), Mock(), Mock()
    judge.settings = ClassifierSettings()
    severity.conditions, lasting.take.return_value = (), np.zeros(HYPOTHESES)
    slope.without.side_effect = lambda item, _: evolve(item, supply=0.95)
    classifier = FaultClassifier(judge, severity, slope=slope, lasting=lasting)
    found = [classifier.classify(item) for item in ticks(50, 1500)]
    assert math.isnan(lasting.take.call_args.args[0].supply)
    assert judge.judge.call_args.args[0].supply == 0.95
    assert severity.take.call_args.args[0].supply == 0.95
    # What is published is what was measured.
    assert all(math.isnan(item.frame.supply) for item in found if item is not None)


@pytest.mark.parametrize("before", [None, 0])
def test_whatever_a_judge_says_a_blind_motor_is_not_named(before: int | None) -> None:
    judge = Fixed()
    classifier = FaultClassifier(judge)
    if before is not None:
        classifier.classify(frame(50))
    judge.wheel = 1
    for item in ticks(100, 1500):
        blind = without(item, [MOTORS[1], ENCODERS[1]], f"{GAP}wheel_2/power")
        diagnosis = classifier.classify(blind)
        expected = STATES[NORMAL] if before is None else STATES[MOTOR]
        assert diagnosis is None or diagnosis.state is expected


class Likely:
    """A network to which wheel 2's signal is lost, and if not that, the floor is slippery."""

    def log_likelihoods(self, window: np.ndarray) -> np.ndarray:
        found = np.full(HYPOTHESES, -20.0)
        found[[CONTROLS.start + 1, SLIP]] = 20.0, 0.0
        return found


class Content:
    """A network to which all is well."""

    def log_likelihoods(self, window: np.ndarray) -> np.ndarray:
        return np.where(np.arange(HYPOTHESES) == NORMAL, 0.0, -3.0)


@pytest.mark.parametrize("period", [20, 50, 200])
def test_what_a_tick_says_of_small_faults_counts_once_at_any_rate(period: int) -> None:
    judge = WindowJudge(cast(WindowNetwork, Content()), ClassifierSettings())
    for t in range(period, 3000, period):
        judge.judge(frame(t), to_ns(1e-3 * period), Unseen())
    said = np.zeros(HYPOTHESES)
    said[DRAGS.start] = 0.3
    for t in range(3000, 4000, period):
        judge.judge(frame(t), to_ns(1e-3 * period), Unseen(), Beside(lasting=said))
    ticks_seen = 1000 / max(period, 50)
    assert judge.gathered == pytest.approx(0.3 * judge.settings.evidence_weight * ticks_seen)


class Lost:
    """A network to which one encoder after the other is lost."""

    wheel = 2

    def log_likelihoods(self, window: np.ndarray) -> np.ndarray:
        found = np.full(HYPOTHESES, -20.0)
        found[LOST_ENCODERS.start + self.wheel] = 20.0
        return found


def test_without_any_speed_no_other_encoder_is_the_lost_one() -> None:
    network = Lost()
    judge = WindowJudge(cast(WindowNetwork, network), ClassifierSettings())
    for t in range(50, 2000, 50):
        opinion = judge.judge(frame(t), to_ns(0.05), Unseen())
    assert (opinion.wheel, opinion.sure) == (2, True)
    network.wheel = 1
    for t in range(2000, 4000, 50):
        unread = without(frame(t), SPEEDS, SCATTER)
        opinion = judge.judge(unread, to_ns(0.05), Unseen())
    assert (opinion.wheel, opinion.sure) == (2, True)
    for t in range(4000, 6000, 50):
        opinion = judge.judge(frame(t), to_ns(0.05), Unseen())
    assert (opinion.wheel, opinion.sure) == (1, True)


def test_what_looks_like_a_blind_motors_fault_is_no_evidence_of_another() -> None:
    judge = WindowJudge(cast(WindowNetwork, Likely()), ClassifierSettings())
    for t in range(50, 5000, 50):
        opinion = judge.judge(frame(t), to_ns(0.05), Unseen(blind=((1, "power sensor dead"),)))
    assert int(opinion.probabilities.argmax()) == NORMAL
    for t in range(5000, 9000, 50):
        opinion = judge.judge(frame(t), to_ns(0.05), Unseen())
    assert (int(opinion.probabilities.argmax()), opinion.wheel) == (CONTROL, 1)


class Leading(Fixed):
    """A judge to which one state leads."""

    def __init__(self, state: State, sure: bool, **settings: Any) -> None:
        super().__init__(**settings)
        self.state, self.sure = state, sure

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        return Opinion(np.eye(6)[NORMAL], self.sure, state=self.state)


def said(judge: Leading, frames: Sequence[ResidualFrame]) -> list[tuple[int, str]]:
    """When the state changed, and to what."""
    classifier = FaultClassifier(judge)
    found = [classifier.classify(item) for item in frames]
    return [((d.stamp_ns - BASE) // MS, d.state.name) for d in found if d is not None and d.changed]


STANDING = {place: -abs(speed) for place, speed in zip(SPEEDS, TURNING, strict=True)}


def test_a_push_is_said_only_where_it_is_striking() -> None:
    assert said(Leading(PUSHED, sure=True), ticks(50, 500)) == [(50, "pushed")]
    assert said(Leading(PUSHED, sure=False), ticks(50, 500)) == [(50, "normal")]


def test_a_robot_that_ignores_its_commands_is_not_pushed() -> None:
    frames = [*ticks(50, 500), *ticks(500, 1000, STANDING)]
    assert said(Leading(PUSHED, sure=True), frames) == [
        (50, "pushed"),
        (500, "normal"),
        (800, "does not follow its commands"),
    ]


@pytest.mark.parametrize("state", [UNKNOWN, BURDENED, *STUCK, *DRAGGING, *DEGRADED, *POWER_SENSOR])
def test_every_state_is_held_raised_and_cleared_alike(state: State) -> None:
    judge = Leading(state, sure=True, raise_time=to_ns(0.3), recovery_time=to_ns(0.6))
    classifier, found = FaultClassifier(judge), []
    for item in ticks(50, 3050):
        at = (item.stamp_ns - BASE) // MS
        judge.state = state if 1000 <= at < 2000 else STATES[NORMAL]
        judge.sure = at != 1200  # a moment of doubt: the time counts anew
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append((at, diagnosis.state.name))
    # The states of a sensor are left at once: they accuse nobody who would have to recover.
    cleared = 2000 if state in POWER_SENSOR else 3000 if state in (UNKNOWN, BURDENED) else 2600
    assert found == [(50, "normal"), (1550, state.name), (cleared, "normal")]


def test_a_robot_that_stands_shows_no_other_fault_than_it_had() -> None:
    """A slip leaves something in the integrals of drivers whose wheels friction holds."""
    judge = Leading(STATES[SLIP], sure=True)
    classifier, found = FaultClassifier(judge), []
    for item in [*ticks(50, 1000), *at_rest(1000, 3000), *ticks(3000, 4000)]:
        at = (item.stamp_ns - BASE) // MS
        judge.state = STATES[SLIP] if at < 1500 else STATES[CONTROL]
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append((at, diagnosis.state.name))
    assert found == [(50, "slip"), (3000, "control system fault")]


def test_a_robot_that_stands_well_may_show_a_fault() -> None:
    judge = Leading(STATES[NORMAL], sure=True)
    classifier, found = FaultClassifier(judge), []
    for item in at_rest(50, 3000):
        at = (item.stamp_ns - BASE) // MS
        judge.state = STATES[CONTROL] if at >= 2000 else STATES[NORMAL]
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append((at, diagnosis.state.name))
    assert found[-1] == (2000, "control system fault")


class OfWheel(Leading):
    """Surely a lost signal, of one wheel."""

    wheel = 0

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        return evolve(super().judge(frame, elapsed_ns, unseen), wheel=self.wheel)


def test_the_same_fault_of_another_wheel_is_said_of_that_one() -> None:
    judge = OfWheel(STATES[CONTROL], sure=True)
    classifier, wheels = FaultClassifier(judge), set()
    for item in ticks(50, 3000):
        judge.wheel = 0 if item.stamp_ns < BASE + 1500 * MS else 2
        diagnosis = classifier.classify(item)
        if diagnosis is not None:
            wheels.add((item.stamp_ns >= BASE + 1500 * MS, diagnosis.wheel))
    assert wheels == {(False, 0), (True, 2)}


def test_slip_shows_now_and_then_and_is_let_go_later_than_a_fault() -> None:
    gone = {}
    for state in (STATES[SLIP], BURDENED, UNKNOWN, STATES[CONTROL], DRAGGING[0]):
        judge, named = Leading(state, sure=True), ""
        classifier = FaultClassifier(judge)
        for item in ticks(50, 3000):
            at = (item.stamp_ns - BASE) // MS
            judge.state = state if at < 1000 else STATES[NORMAL]
            diagnosis = classifier.classify(item)
            if diagnosis is not None and diagnosis.changed:
                named, gone[state.name] = diagnosis.state.name, at
        assert named == "normal"
    late = dict.fromkeys(("slip", BURDENED.name, UNKNOWN.name), 2000)
    assert gone == {**late, "control system fault": 1500, DRAGGING[0].name: 1500}


def test_which_fault_of_a_motor_it_is_may_be_settled_while_its_time_passes() -> None:
    judge = Leading(DRAGGING[1], sure=True, raise_time=to_ns(0.5))
    classifier, found = FaultClassifier(judge), []
    for item in ticks(50, 2000):
        at = (item.stamp_ns - BASE) // MS
        judge.state = DRAGGING[1] if at < 300 else STATES[MOTOR + 1] if at < 1000 else STUCK[2]
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append((at, diagnosis.state.name))
    # Another motor's counts anew.
    assert found[1:] == [(550, "motor system fault 2"), (1500, "stuck wheel 3")]


def test_what_ails_a_motor_may_turn_out_at_once_after_it_was_named() -> None:
    judge = Leading(DRAGGING[1], sure=True)
    classifier = FaultClassifier(judge)
    classifier.classify(frame(50))
    judge.state = STATES[MOTOR + 1]
    diagnosis = classifier.classify(frame(100))
    assert diagnosis is not None
    assert diagnosis.state is STATES[MOTOR + 1]
    assert diagnosis.since_ns == BASE + 50 * MS


def test_without_enough_data_no_robot_is_said_to_ignore_its_commands() -> None:
    """Its wheels stand when the encoders come back; half of the last second must be known."""
    gap = [without(f, [*SPEEDS, *ENCODERS], f"{GAP}joint_states") for f in ticks(2000, 2800)]
    frames = [*ticks(50, 2000), *gap, *ticks(2800, 4000, STANDING)]
    found = said(Leading(STATES[NORMAL], sure=True), frames)
    assert found[-2:] == [(2500, "not enough data"), (3250, "does not follow its commands")]
