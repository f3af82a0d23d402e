"""The window classifier: what it sees, how it gathers evidence, what it says of a motion."""

import json
import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    ENDED,
    EXTERNAL,
    HYPOTHESES,
    LOADED,
    METERS,
    OTHER,
    STATE_OF,
    WEAKS,
    Belief,
    _transitions,
    named_of,
    of_states,
)
from tomr_fault_diag.classifier.contacts import NOTHING, Contacts
from tomr_fault_diag.classifier.evidence import Beside
from tomr_fault_diag.classifier.features import (
    BLIND,
    CHANNELS,
    INPUTS,
    WINDOW,
    band_ratios,
    by_wheel,
    channels,
    channels_of,
)
from tomr_fault_diag.classifier.judges import _GROUPS, Opinion, WindowJudge, make_judge
from tomr_fault_diag.classifier.messages import diagnosis_message
from tomr_fault_diag.classifier.observability import MotionWatch, Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import (
    CONTROL,
    DEGRADED,
    DRAGGING,
    FAULTLESS,
    MOTOR,
    NAMED,
    NORMAL,
    NOT_OBSERVABLE,
    POWER_SENSOR,
    SLIP,
    STATES,
    STUCK,
    UNKNOWN,
    State,
)
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import Level
from tomr_power_model.robot import shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN = float("nan")
Three = tuple[float, float, float]
NONE: Three = (0.0, 0.0, 0.0)
# Wheel speeds of a straight drive in which every wheel turns, and of one with wheel 1 idle.
ALL: Three = (3.0, -8.0, 5.0)
IDLE: Three = (0.0, -8.0, 8.0)


def frame(
    tick: int,
    expected: Three = ALL,
    speed: Three = NONE,
    power: Three = NONE,
    derived: Three = NONE,
) -> ResidualFrame:
    """Speeds expected [rad/s]; residuals of speed, power and derived power by wheel."""
    total = Residual(sum(power), 2.3, 18.0)
    motors = tuple(Residual(value, 2.0, 2.0) for value in power)
    speeds = tuple(
        Residual(off, 0.2, want, "rad/s") for off, want in zip(speed, expected, strict=True)
    )
    encoders = tuple(Residual(value, 2.0, 2.0) for value in derived)
    return ResidualFrame(BASE + tick * 50 * MS, (total, *motors, *speeds, *encoders))


def run(frames: Sequence[ResidualFrame]) -> list[Diagnosis]:
    """Diagnoses of the shipped window classifier."""
    classifier = FaultClassifier(make_judge(ClassifierSettings()))
    found = [classifier.classify(item) for item in frames]
    return [diagnosis for diagnosis in found if diagnosis is not None]


def _changes(found: Sequence[Diagnosis]) -> list[str]:
    return [diagnosis.state.name for diagnosis in found if diagnosis.changed]


# Encoder of wheel 2 lost: it reads standstill while its motor draws more and more.
LOST = {"speed": (0.1, -8.0, 0.1), "power": (4.0, 30.0, 4.0), "derived": (4.0, 32.0, 4.0)}


def test_channels_by_hand() -> None:
    seen = channels_of(frame(0, ALL, speed=(0.2, -0.4, NAN), power=(2.0, 0.0, -2.0)))
    one = np.arcsinh(3.0)
    assert (seen[:2] == 0.0).all()
    np.testing.assert_allclose(seen[2:5], [one, 0.0, -one])
    # What is measured: 4 W, 2 W and nothing, each against a band of 2 W.
    np.testing.assert_allclose(seen[8:11], [np.arcsinh(6.0), one, 0.0])
    # "Slower than commanded" by 0.4 rad/s at -8 rad/s is +0.4 rad/s; an unknown one is as modelled.
    np.testing.assert_allclose(seen[11:14], [one, np.arcsinh(6.0), 0.0])
    np.testing.assert_allclose(seen[14:17], np.arcsinh([6.0, -16.0, 10.0]))
    np.testing.assert_allclose(seen[17:20], np.arcsinh([6.4, -15.2, 10.0]))


def test_the_battery_shows_whether_a_motor_really_draws_what_its_sensor_says() -> None:
    """Wheel 1 seems to draw 4 W too much: the battery gives 1 W of it, or all, or is unknown."""
    motor = frame(0, ALL, power=(4.0, 0.0, 0.0))

    def balance(total: Residual) -> float:
        return float(channels_of(evolve(motor, residuals=(total, *motor.residuals[1:])))[1])

    # 3 W less than the motors say, against the least band of 2 W.
    assert balance(Residual(1.0, 2.3, 18.0)) == pytest.approx(np.arcsinh(3.0 * -3.0 / 2.0))
    assert balance(Residual(4.0, 2.3, 18.0)) == 0.0
    assert balance(Residual(NAN, NAN, 18.0)) == 0.0
    assert balance(Residual(1.0, 2.3, 18.0, "A")) == 0.0


def test_unknown_power_looks_as_modelled_and_draws_nothing() -> None:
    seen = channels_of(frame(0, ALL, power=(NAN, 0.0, 0.0)))
    assert seen[2] == seen[8] == 0.0
    assert seen[9] > 0.0


def test_a_model_that_is_beyond_all_looks_as_modelled() -> None:
    item = frame(0, ALL)
    endless = evolve(item.residuals[1], residual=math.inf, modelled=-math.inf)
    other = evolve(item.residuals[2], residual=-math.inf)
    seen = channels_of(
        evolve(item, residuals=(item.residuals[0], endless, other, *item.residuals[3:]))
    )
    assert np.isfinite(seen).all()


def test_each_wheel_sees_itself_first_and_turning_forwards() -> None:
    window = np.arange(WINDOW * CHANNELS, dtype=float).reshape(WINDOW, CHANNELS) + 1.0
    window[:, 15] *= -1.0  # wheel 2 turns backwards
    views = by_wheel(window).reshape(3, WINDOW, CHANNELS)
    np.testing.assert_array_equal(views[0], window)
    np.testing.assert_array_equal(views[1, :, 2:5], window[:, [3, 4, 2]])
    np.testing.assert_array_equal(views[1, :, 14:17], -window[:, [15, 16, 14]])
    np.testing.assert_array_equal(views[2, :, 8:14], window[:, [10, 8, 9, 13, 11, 12]])


def test_another_numbering_of_the_wheels_names_the_other_wheel() -> None:
    network, random = WindowNetwork.load(), np.random.default_rng(0)
    window = random.normal(0.0, 1.0, (WINDOW, CHANNELS))
    turned = window[:, [0, 1, *(2 + 3 * g + (w + 1) % 3 for g in range(6) for w in range(3))]]
    ahead, found = network.scores_of(window), network.scores_of(turned)
    common = [NORMAL, SLIP, EXTERNAL, OTHER]
    np.testing.assert_allclose(found[common], ahead[common])
    for kind in (CONTROLS, ENCODERS, DRAGS, WEAKS, METERS):
        np.testing.assert_allclose(found[kind], np.roll(ahead[kind], -1))


def test_inference_equals_the_training_framework() -> None:
    """Scores of torch for the shipped weights, stored by `tomr_train` beside them."""
    shipped = json.loads(
        files("tomr_fault_diag").joinpath("weights").joinpath("window.json").read_text()
    )["torch_check"]
    found = WindowNetwork.load().scores_of(np.array(shipped["windows"]))
    np.testing.assert_allclose(found, np.array(shipped["scores"]), atol=0.01, rtol=1e-3)


def _against_all_but(hypothesis: int, size: float) -> np.ndarray:
    likelihoods = np.full(HYPOTHESES, -size)
    likelihoods[hypothesis] = 0.0
    return of_states(likelihoods)


def test_belief_by_hand() -> None:
    """One window that says e^-10 of everything but slip, at half weight: odds of 10^-9 e^5."""
    belief = Belief(0.5, 9.0)
    shares = belief.update(_against_all_but(SLIP, 10.0))
    # Slip of 10^-4, seven faults of 10^-9, nine of 10^-13, one of 10^-11, and a push of 10^-3.
    odds = 1e-4 * np.exp(5.0) / (1.0 - 1e-4 - 7e-9 - 9e-13 - 1e-11 - 1e-3)
    assert shares[SLIP] / shares[NORMAL] == pytest.approx(odds, rel=1e-6)
    assert named_of(shares).sum() == pytest.approx(1.0)
    assert len(named_of(shares)) == len(NAMED)


@pytest.mark.parametrize("caution", [0.0, 2.0, 4.0, 5.0, 11.0, 30.0])
def test_without_evidence_a_robot_is_well_whatever_the_caution(caution: float) -> None:
    belief = Belief(0.5, caution)
    for _ in range(10):
        shares = belief.update(np.zeros(len(STATE_OF)))
    assert (shares > 0.0).all()
    assert shares.sum() == pytest.approx(1.0)
    assert shares[NORMAL] > 0.8


@pytest.mark.parametrize("state", [SLIP, ENCODERS.start, DRAGS.start, METERS.start, OTHER])
def test_a_decade_of_caution_is_a_decade_of_odds_for_every_fault(state: int) -> None:
    odds = []
    for caution in (10.0, 20.0, 30.0):
        belief = Belief(0.5, caution)
        belief.update(_against_all_but(state, 10.0))
        odds.append(np.log10(belief.shares[state] / belief.shares[NORMAL]))
    assert np.diff(odds) == pytest.approx([-10.0, -10.0], abs=0.01)


def test_probabilities_stand_beside_their_states() -> None:
    for hypothesis, state in enumerate(STATE_OF):
        shares = np.eye(len(STATE_OF))[hypothesis]
        assert NAMED[int(named_of(shares).argmax())] is state


def test_silence_leaves_a_belief_as_it_is() -> None:
    belief = Belief(0.4, 10.0)
    for _ in range(40):
        belief.update(_against_all_but(ENCODERS.start + 1, 20.0))
    assert belief.shares[ENCODERS.start + 1] > 0.999
    for _ in range(200):  # ten seconds in which nothing can be distinguished
        belief.update(np.zeros(len(STATE_OF)))
    assert belief.shares[ENCODERS.start + 1] > 0.97


def test_a_force_is_a_push_first_and_a_load_when_it_lasts() -> None:
    belief, likelihoods = Belief(0.4, 11.0), _against_all_but(EXTERNAL, 20.0)
    lasted = next(k for k in range(200) if belief.update(likelihoods)[LOADED] > 0.99)
    assert 90 < lasted < 150  # 5 to 7 s
    belief.clear()
    for _ in range(20):
        assert belief.update(likelihoods)[LOADED] < 1e-3
    assert belief.shares[EXTERNAL] > 0.99
    for _ in range(10):
        belief.update(_against_all_but(NORMAL, 20.0))
    assert belief.shares[NORMAL] > 0.99


@pytest.mark.parametrize(
    ("state", "decades"),
    [(SLIP, -4), (ENCODERS.start, -9), (DRAGS.start, -13), (OTHER, -11), (EXTERNAL, -3)],
)
def test_how_rare_each_state_is_before_anything_was_seen(state: int, decades: int) -> None:
    belief = Belief(0.5, 9.0)
    belief.update(_against_all_but(state, 10.0))
    odds = belief.shares[state] / belief.shares[NORMAL]
    assert np.log10(odds / np.exp(5.0)) == pytest.approx(decades, abs=0.2)


def test_a_slippery_place_is_left_sooner_than_a_fault_ends() -> None:
    ends = []
    for state in (SLIP, ENCODERS.start):
        belief = Belief(0.5, 9.0)
        belief.shares = np.eye(len(STATE_OF))[state]
        shares = belief.update(np.zeros(len(STATE_OF)))
        ends.append(named_of(shares)[NORMAL])
    assert ends == pytest.approx([5e-3, 1e-4], rel=0.01)


def test_evidence_is_none_where_windows_speak_against_the_fault() -> None:
    network = Saying()
    network.likelihoods[:] = -20.0
    network.likelihoods[[NORMAL, ENCODERS.start]] = 0.0, -6.0
    settings = ClassifierSettings(caution=30.0, striking=-100.0)
    judge = WindowJudge(network, settings)  # type: ignore[arg-type]
    for tick in range(20):
        judge.judge(frame(tick), 50 * MS, Unseen())
    assert judge.evidence() == 0.0


def test_a_push_is_no_load_either_where_a_fault_was_believed() -> None:
    belief = Belief(0.5, 11.0)
    for _ in range(20):
        belief.update(_against_all_but(WEAKS.start, 20.0))
    for _ in range(8):
        belief.update(_against_all_but(EXTERNAL, 20.0))
    assert belief.shares[EXTERNAL] > 0.99
    assert belief.shares[LOADED] < 1e-6


@pytest.mark.parametrize("caution", [9.0, 12.0])
def test_one_fault_does_not_become_another(caution: float) -> None:
    """Wheels that one makes slide may look like a fault of theirs; a second one is as rare."""
    belief, first, second = Belief(0.5, caution), ENCODERS.start + 1, ENCODERS.start + 2
    belief.shares = np.eye(len(STATE_OF))[first]
    belief.update(_against_all_but(second, 10.0))
    odds = belief.shares[second] / belief.shares[first]
    assert np.log10(odds / np.exp(5.0)) == pytest.approx(-caution, abs=0.2)


@pytest.mark.parametrize("state", [SLIP, LOADED])
@pytest.mark.parametrize(
    ("fault", "decades"), [(CONTROLS.start, -9), (ENCODERS.start, -9), (WEAKS.start + 1, -13)]
)
def test_a_fault_on_a_slippery_floor_or_under_a_load_is_as_rare_as_without(
    state: int, fault: int, decades: int
) -> None:
    """The wheels that grip again after a slide look like a motor for a moment."""
    belief = Belief(0.5, 9.0)
    belief.shares = np.eye(len(STATE_OF))[state]
    belief.update(_against_all_but(fault, 10.0))
    odds = belief.shares[fault] / belief.shares[state]
    assert np.log10(odds / np.exp(5.0)) == pytest.approx(decades, abs=0.2)


@pytest.mark.parametrize("state", [SLIP, LOADED])
def test_a_fault_that_lasts_is_distinguished_from_the_slip_or_load_before(state: int) -> None:
    belief = Belief(0.4, 11.0)
    belief.shares = np.eye(len(STATE_OF))[state]
    for _ in range(10):  # half a second
        belief.update(_against_all_but(ENCODERS.start, 20.0))
    assert belief.shares[ENCODERS.start] > 0.99


def test_what_looks_like_another_fault_every_moment_is_none_that_is_known() -> None:
    belief = Belief(0.4, 11.0)
    for k in range(30):
        belief.update(_against_all_but((CONTROLS, ENCODERS, DRAGS)[k // 3 % 3].start, 20.0))
    assert belief.shares[OTHER] > 0.99
    belief.clear()
    for _ in range(30):
        belief.update(_against_all_but(DRAGS.start, 20.0))
    assert belief.shares[DRAGS.start] > 0.99


@pytest.mark.parametrize("fault", [CONTROLS.start + 1, ENCODERS.start + 1])
def test_a_wheel_that_catches_up_after_a_fault_has_no_other(fault: int) -> None:
    """The transient of 0.4 s and its passing out of the window look like a weak motor."""
    belief = Belief(0.5, 11.0)
    for _ in range(40):
        belief.update(_against_all_but(fault, 20.0))
    caught_up = [_against_all_but(WEAKS.start + 1, 8.0)] * 14 + [_against_all_but(NORMAL, 3.0)] * 8
    named = [named_of(belief.update(likelihoods)) for likelihoods in caught_up]
    assert max(share[NAMED.index(DEGRADED[1])] for share in named) < 0.5
    assert all(share[NORMAL] > 0.5 for share in named[8:])
    assert belief.shares[NORMAL] > 0.9


def test_a_wheel_that_catches_up_looks_well_or_like_any_fault_of_a_motor() -> None:
    likelihoods = np.full(HYPOTHESES, -9.0)
    likelihoods[[NORMAL, METERS.start]] = -2.0, 5.0
    guessed = math.log(2.5)
    np.testing.assert_allclose(of_states(likelihoods)[ENDED], -2.0 - guessed)
    likelihoods[WEAKS.start + 1] = 1.0
    np.testing.assert_allclose(of_states(likelihoods)[ENDED], 1.0 - guessed)


def test_what_the_other_wheels_feel_of_one_that_catches_up_is_no_fault_either() -> None:
    belief = Belief(0.5, 11.0)
    for _ in range(40):
        belief.update(_against_all_but(ENCODERS.start, 20.0))
    for _ in range(6):
        belief.update(_against_all_but(WEAKS.start + 1, 4.0))
    assert belief.shares[WEAKS.start + 1] < 1e-3
    for _ in range(6):
        belief.update(_against_all_but(NORMAL, 3.0))
    assert belief.shares[NORMAL] > 0.9


@pytest.mark.parametrize("next_one", [WEAKS.start + 1, CONTROLS.start, METERS.start + 1])
def test_another_fault_that_stays_is_named_after_all(next_one: int) -> None:
    """Of a motor it takes a second: so long a wheel may be catching up."""
    belief = Belief(0.5, 11.0)
    for _ in range(40):
        belief.update(_against_all_but(ENCODERS.start + 1, 20.0))
    lasted = next(
        k for k in range(99) if belief.update(_against_all_but(next_one, 20.0))[next_one] > 0.99
    )
    assert lasted < (6 if next_one == METERS.start + 1 else 20)


def test_no_chance_is_lost_between_states() -> None:
    for caution in (0.0, 4.0, 11.0, 30.0):
        moves = _transitions(10.0**-caution)
        np.testing.assert_allclose(moves.sum(axis=1), 1.0, atol=1e-12)
        assert (moves > -1e-12).all()


def test_every_state_leads_with_one_group() -> None:
    assert sorted(state for group in _GROUPS for state in group) == list(range(len(STATE_OF)))


class Saying:
    """A network that says the same of every window."""

    def __init__(self) -> None:
        self.likelihoods = np.zeros(HYPOTHESES)

    def log_likelihoods(self, window: np.ndarray) -> np.ndarray:
        return self.likelihoods.copy()


def _said(network: Saying, judge: WindowJudge, hypothesis: int, item: ResidualFrame) -> Opinion:
    network.likelihoods[:] = -30.0
    network.likelihoods[hypothesis] = 0.0
    return judge.judge(item, 50 * MS, Unseen())


@pytest.mark.parametrize(
    ("hypothesis", "state", "paper"),
    [
        (DRAGS.start + 2, DRAGGING[2], "motor system fault 3"),
        (WEAKS.start, DEGRADED[0], "motor system fault 1"),
        (METERS.start + 1, POWER_SENSOR[1], None),
        (OTHER, UNKNOWN, None),
    ],
)
def test_states_beyond_the_papers_and_what_it_would_call_them(
    hypothesis: int, state: State, paper: str | None
) -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for tick in range(20):
        opinion = _said(network, judge, hypothesis, frame(tick))
    assert opinion.sure
    assert opinion.leading is state
    assert opinion.wheel == state.wheel
    assert (None if state.paper is None else STATES[state.paper].name) == paper


def test_what_windows_say_only_slightly_never_adds_up_to_a_drag() -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for over, state in ((0.8, STATES[NORMAL]), (4.0, DRAGGING[0])):
        network.likelihoods[DRAGS.start] = over
        for tick in range(400):
            opinion = judge.judge(frame(tick), 50 * MS, Unseen())
        assert opinion.leading is state


@pytest.mark.parametrize(("off", "state"), [(1.0, POWER_SENSOR[0]), (-1.0, STATES[NORMAL])])
def test_no_power_sensor_makes_a_wheel_turn_otherwise(off: float, state: State) -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for tick in range(20):
        item = frame(tick, ALL, speed=(off if off < 0.0 else 0.0, 0.0, 0.0))
        opinion = _said(network, judge, METERS.start, item)
    assert opinion.leading is state


def test_a_wheel_that_stands_while_it_drags_is_stuck() -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for tick in range(20):
        opinion = _said(network, judge, DRAGS.start, frame(tick, ALL, speed=(-3.0, 0.0, 0.0)))
    assert opinion.leading is STUCK[0]
    for tick in range(20, 40):
        opinion = _said(network, judge, DRAGS.start, frame(tick, ALL, speed=(-1.0, 0.0, 0.0)))
    assert opinion.leading is DRAGGING[0]


def test_what_ails_a_motor_is_said_when_the_window_holds_nothing_older() -> None:
    """At first a lost encoder looks like a wheel that stands."""
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    first: dict[str, int] = {}

    def standing_at(tick: int) -> ResidualFrame:
        return frame(tick, ALL, speed=(-3.0, 0.0, 0.0))

    for tick in range(40):
        opinion = _said(network, judge, DRAGS.start, standing_at(tick))
        if opinion.sure:
            first.setdefault(opinion.leading.name, tick)
    assert list(first) == ["motor system fault 1", STUCK[0].name]
    assert 0 < first[STUCK[0].name] - first["motor system fault 1"] < WINDOW
    names = []
    for tick in range(40, 60):  # a moment of normal makes no new fault of it
        leading = NORMAL if 45 <= tick < 48 else DRAGS.start
        names.append(_said(network, judge, leading, standing_at(tick)).leading.name)
    assert "motor system fault 1" not in names


def _first_names(
    network: Saying, judge: WindowJudge, hypothesis: int, ticks: range, speed: float = 0.0
) -> list[str]:
    """Faults of wheel 1 in the order in which they are named."""
    found: dict[str, None] = {}
    for tick in ticks:
        item = frame(tick, ALL, speed=(speed, 0.0, 0.0))
        opinion = _said(network, judge, hypothesis, item)
        if opinion.sure and 0 in (opinion.wheel, opinion.leading.wheel):
            found[opinion.leading.name] = None
    return list(found)


@pytest.mark.parametrize(
    ("hypothesis", "cause"), [(DRAGS.start, DRAGGING[0]), (WEAKS.start, DEGRADED[0])]
)
def test_every_cause_waits_for_a_window_of_it_alone(hypothesis: int, cause: State) -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    expected = ["motor system fault 1", cause.name]
    assert _first_names(network, judge, hypothesis, range(40)) == expected
    # After another motor's, and when all is forgotten, anew.
    _first_names(network, judge, ENCODERS.start + 1, range(40, 80))
    assert _first_names(network, judge, hypothesis, range(80, 120)) == expected
    judge.clear()
    assert _first_names(network, judge, hypothesis, range(120, 160)) == expected


def test_what_a_wheel_does_that_catches_up_leads_to_nothing() -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for tick in range(40):
        _said(network, judge, ENCODERS.start, frame(tick))
    leading = []
    for tick in range(40, 54):
        network.likelihoods[:], network.likelihoods[WEAKS.start] = -8.0, 0.0
        leading.append(judge.judge(frame(tick), 50 * MS, Unseen()).leading)
    assert leading[-1] is STATES[NORMAL]


def test_a_fault_that_is_surely_of_one_motor_is_named_though_its_cause_is_not() -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    network.likelihoods[:] = -30.0
    network.likelihoods[[DRAGS.start, WEAKS.start]] = 0.0
    for tick in range(20):
        opinion = judge.judge(frame(tick), 50 * MS, Unseen())
    assert opinion.probabilities.max() < 0.6
    assert opinion.sure
    assert opinion.leading in (DRAGGING[0], DEGRADED[0])


@pytest.mark.parametrize("state", [ENCODERS.start, DRAGS.start, WEAKS.start, METERS.start, SLIP])
def test_evidence_says_how_much_caution_a_fault_overcomes(state: int) -> None:
    """Half a decade in each tick: a judge of any caution is sure where its evidence says so."""
    network = Saying()
    network.likelihoods[state] = 2.5 + (state not in (SLIP, ENCODERS.start))
    settings = ClassifierSettings(striking=0.0)

    def judge(caution: float) -> WindowJudge:
        return WindowJudge(network, evolve(settings, caution=caution))  # type: ignore[arg-type]

    def first(said: Sequence[bool]) -> int:
        return said.index(True)

    witness, evidence, cautions = judge(30.0), [], (9.0, 14.0, 20.0)
    others, sure = [judge(caution) for caution in cautions], []
    for tick in range(80):
        witness.judge(frame(tick), 50 * MS, Unseen())
        evidence.append(witness.evidence())
        said = [other.judge(frame(tick), 50 * MS, Unseen()) for other in others]
        wanted = [STATE_OF[state]]  # or, until its cause is named, what the paper calls it
        if wanted[0] in (*DRAGGING, *DEGRADED) and wanted[0].paper is not None:
            wanted.append(STATES[wanted[0].paper])
        sure.append([one.sure and one.leading in wanted for one in said])
    for k, caution in enumerate(cautions):
        named = first([row[k] for row in sure])
        assert abs(named - first([decades > caution + 2.0 for decades in evidence])) <= 1


def test_what_may_be_either_of_two_faults_is_evidence_of_neither() -> None:
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings(caution=30.0))  # type: ignore[arg-type]
    network.likelihoods[:] = -30.0
    network.likelihoods[[ENCODERS.start, ENCODERS.start + 1]] = 0.0
    for tick in range(40):
        judge.judge(frame(tick), 50 * MS, Unseen())
    assert judge.evidence() == 0.0


def test_a_push_is_said_and_accuses_nobody() -> None:
    network, found = Saying(), []
    classifier = FaultClassifier(WindowJudge(network, ClassifierSettings()))  # type: ignore[arg-type]
    for tick in range(60):
        network.likelihoods[:] = -30.0
        network.likelihoods[EXTERNAL if 20 <= tick < 30 else NORMAL] = 0.0
        diagnosis = classifier.classify(frame(tick))
        if diagnosis is not None:
            found.append(diagnosis)
    assert _changes(found) == ["normal", "pushed", "normal"]
    assert {diagnosis.state.level for diagnosis in found} == {Level.OK}


@pytest.mark.parametrize(("idle", "state"), [((), 0), ((0,), 0), ((2,), CONTROL)])
def test_an_idle_wheel_does_not_refute_its_fault(idle: tuple[int, ...], state: int) -> None:
    """The signal of wheel 3 is lost; then five seconds that look normal, wheel 3 idle or not."""
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    network.likelihoods[:] = -30.0
    network.likelihoods[CONTROLS.start + 2] = 0.0
    for tick in range(20):
        judge.judge(frame(tick), 50 * MS, Unseen())
    network.likelihoods[:] = -3.0
    network.likelihoods[0] = 0.0
    for tick in range(100):
        opinion = judge.judge(frame(20 + tick), 50 * MS, Unseen(idle))
    assert int(np.argmax(opinion.probabilities)) == state


def test_a_lost_encoder_is_named_within_half_a_second() -> None:
    found = run([frame(t) for t in range(40)] + [frame(40 + t, ALL, **LOST) for t in range(20)])
    named = next(d for d in found if d.state is STATES[MOTOR + 1])
    assert named.stamp_ns - (BASE + 40 * 50 * MS) <= 500 * MS
    assert named.wheel == 1


def _coasting(start: int, count: int) -> list[ResidualFrame]:
    """Wheel 3 without a signal coasts to a stop, its motor draws nothing."""
    return [
        frame(start + t, ALL, (0.0, 0.0, -min(5.0, 0.5 * t)), (0.3, 0.3, -1.0))
        for t in range(count)
    ]


def test_a_fault_stays_named_at_rest_and_recovers_in_motion() -> None:
    moving = [frame(t) for t in range(40)] + _coasting(40, 40)
    still = [frame(80 + t, NONE) for t in range(60)]
    healthy = [frame(140 + t) for t in range(60)]
    found = run(moving + still)
    assert found[-1].state is STATES[CONTROL]
    assert found[-1].unseen.everything
    assert run(moving + still + healthy)[-1].state.name == "normal"


def test_a_lost_signal_shows_its_wheel() -> None:
    found = run([frame(t) for t in range(40)] + _coasting(40, 30))
    assert found[-1].state is STATES[CONTROL]
    assert found[-1].wheel == 2
    status = diagnosis_message(shipped_robot("reference"), found[-1], "").statuses[0]
    assert status.message == "control system fault (wheel_3_joint)"


def test_a_blip_is_no_fault() -> None:
    blip = [frame(40 + t, ALL, **LOST) for t in range(1)]
    found = run([frame(t) for t in range(40)] + blip + [frame(41 + t) for t in range(40)])
    assert _changes(found) == ["normal"]


def test_what_a_motion_cannot_show() -> None:
    robot = shipped_robot("reference")
    idle = run([frame(t, IDLE) for t in range(60)])[-1]
    assert idle.state.name == "normal"
    status = diagnosis_message(robot, idle, "").statuses[0]
    assert status.message == "normal; motor 1 not observable in this motion"
    assert dict(status.values)["not_observable"] == "motor 1, slip"
    still = run([frame(t, NONE) for t in range(60)])[-1]
    assert still.state is NOT_OBSERVABLE
    assert still.state.level is Level.OK
    turning = run([frame(t, (3.0 + 0.2 * t, -8.0, 5.0 - 0.2 * t)) for t in range(60)])[-1]
    assert turning.unseen.words == ()


def test_a_wheel_that_moves_without_being_commanded_is_not_idle() -> None:
    found = run([frame(t, IDLE, speed=(2.0, 0.0, 0.0)) for t in range(60)])
    assert found[-1].unseen.wheels == ()
    assert found[-1].unseen.moved == (0,)
    found = run([frame(t, ALL, speed=(2.0, 0.0, 0.0)) for t in range(60)])
    assert found[-1].unseen.moved == ()


@pytest.mark.parametrize("kind", [CONTROLS, ENCODERS, DRAGS, WEAKS])
def test_who_turns_a_wheel_that_should_stand_is_no_fault_of_its_motor(kind: slice) -> None:
    network = Saying()
    network.likelihoods[:] = -30.0
    network.likelihoods[[NORMAL, kind.start + 1, kind.start + 2]] = -20.0, 0.0, -0.5

    def leading(unseen: Unseen) -> Opinion:
        judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
        for tick in range(20):
            opinion = judge.judge(frame(tick), 50 * MS, unseen)
        return opinion

    assert leading(Unseen()).wheel == 1
    assert leading(Unseen(moved=(1,))).wheel == 2
    # Others that drive pull along a wheel without its signal, and no other.
    pulled = leading(Unseen(moved=(1,), driven=True)).wheel
    assert pulled == (1 if kind is CONTROLS else 2)


def test_what_a_push_leaves_is_slip_only_where_forces_show_one() -> None:
    network = Saying()
    network.likelihoods[:] = -30.0
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]

    def said(ticks: int, first: int, contacts: Contacts = NOTHING) -> NDArray[np.float64]:
        for tick in range(first, first + ticks):
            judge.judge(frame(tick), 50 * MS, Unseen(), Beside(contacts))
        newest = judge._recent[-1]
        return newest - newest[NORMAL]

    network.likelihoods[[NORMAL, EXTERNAL]] = -20.0, 0.0
    said(20, 0)
    network.likelihoods[[NORMAL, EXTERNAL, SLIP]] = 0.0, -20.0, 5.0
    # It is over by belief after some ticks, and shows for 12 more.
    assert said(5, 20)[SLIP] == pytest.approx(5.0 + 4.0 - 2.0)
    assert said(1, 25, Contacts(0.9))[SLIP] == pytest.approx(9.0 + 3.0 * math.log(9.0))
    assert said(30, 26)[SLIP] == pytest.approx(9.0)


@pytest.mark.parametrize(("before", "first"), [(NORMAL, 10.0), (EXTERNAL, 8.0)])
def test_what_a_push_leaves_is_hardly_a_lost_signal(before: int, first: float) -> None:
    """Until it is believed, which it is while the push would still show."""
    network, said = Saying(), []
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    for tick, leading in enumerate([before] * 20 + [CONTROLS.start] * 11):
        network.likelihoods[:] = -30.0
        network.likelihoods[[leading, NORMAL]] = 10.0, 0.0
        judge.judge(frame(tick), 50 * MS, Unseen())
        if leading == CONTROLS.start:
            said.append(judge._recent[-1][leading] - judge._recent[-1][NORMAL])
    assert judge._shaken > 0 or before == NORMAL
    assert said[0] == pytest.approx(first)
    assert said[-1] == pytest.approx(10.0)


@pytest.mark.parametrize("kind", [CONTROLS, ENCODERS, DRAGS, WEAKS, METERS])
def test_what_a_slope_explains_accuses_no_wheel(kind: slice) -> None:
    """But one that has been accused before, and a power sensor."""
    network = Saying()
    network.likelihoods[:] = -30.0
    judge = WindowJudge(network, ClassifierSettings(striking=0.0))  # type: ignore[arg-type]

    def accused(ticks: int, first: int, contacts: Contacts) -> bool:
        for tick in range(first, first + ticks):
            opinion = judge.judge(frame(tick), 50 * MS, Unseen(), Beside(contacts))
        return opinion.sure and opinion.wheel == 0

    on_a_slope, on_the_level = Contacts(0.0, force=True), Contacts(0.0)
    network.likelihoods[[NORMAL, kind.start]] = 0.0, 4.0
    assert accused(40, 0, on_a_slope) == (kind is METERS)
    assert accused(30, 40, on_the_level)
    assert accused(30, 70, on_a_slope)
    # What fits nothing accuses none, so the slope explains; but what was named may be so again
    # for a while.
    judge.clear()
    network.likelihoods[[kind.start, OTHER]] = -30.0, 4.0
    accused(40, 0, on_a_slope)
    assert judge._best == OTHER
    network.likelihoods[[kind.start, OTHER]] = 12.0, 4.0
    assert accused(20, 40, on_a_slope) == (kind is METERS)
    judge.clear()
    assert accused(30, 0, on_the_level)
    network.likelihoods[[kind.start, OTHER]] = -30.0, 4.0
    accused(40, 30, on_a_slope)
    assert judge._best == OTHER
    network.likelihoods[[kind.start, OTHER]] = 12.0, 4.0
    assert accused(20, 70, on_a_slope)


def test_where_it_grips_or_within_bands_of_its_own_a_robot_hardly_slips() -> None:
    network = Saying()
    network.likelihoods[SLIP] = 5.0

    def said(commissioned: str, contacts: Contacts) -> list[float]:
        """At first, and when slip has been believed for long."""
        settings, found = ClassifierSettings(commissioned=commissioned), []
        judge = WindowJudge(network, settings)  # type: ignore[arg-type]
        for tick in range(40):
            judge.judge(frame(tick), 50 * MS, Unseen(), Beside(contacts))
            found += [newest[SLIP] - newest[NORMAL] for newest in list(judge._recent)[-1:]]
        return [float(found[0]), float(found[-1])]

    calm, grips, slides = Contacts(0.0, calm=True), Contacts(0.09), Contacts(0.11)
    plain = np.array(said("2026-01-01", NOTHING))
    assert said("2026-01-01", calm) == pytest.approx(plain - 2.0)
    assert said("2026-01-01", grips) == pytest.approx(plain - [2.0, 0.0])
    assert said("2026-01-01", slides) == said("", calm) == said("", grips) == list(plain)
    # What an accelerometer feels of it counts more, and without commissioning as well.
    felt = Contacts(0.09, felt=True)
    assert said("2026-01-01", felt) == said("", felt) == pytest.approx(plain - 10.0)
    assert said("2026-01-01", evolve(calm, felt=True)) == pytest.approx(plain - 10.0)
    assert said("", evolve(calm, felt=True)) == list(plain)
    assert said("2026-01-01", Contacts(0.11, felt=True)) == list(plain)


def test_a_robot_that_stands_says_the_same_again_and_again() -> None:
    """Only what strikes counts there; slight evidence for a fault, or against it, does not."""
    settings = ClassifierSettings()

    def share(size: float, state: int, unseen: Unseen) -> float:
        network = Saying()
        judge = WindowJudge(network, settings)  # type: ignore[arg-type]
        network.likelihoods[state] = size
        for tick in range(200):
            opinion = judge.judge(frame(tick), 50 * MS, unseen)
        return float(opinion.probabilities[0])

    still = Unseen((0, 1, 2), slip=True)
    slight, striking = settings.striking - 0.5, settings.striking + 0.5
    assert share(slight, ENCODERS.start, Unseen()) < 0.01
    assert share(slight, ENCODERS.start, still) > 0.99
    assert share(striking, ENCODERS.start, still) < 0.01

    def believed(size: float) -> float:
        network = Saying()
        judge = WindowJudge(network, settings)  # type: ignore[arg-type]
        network.likelihoods[ENCODERS.start] = size
        for tick in range(40):
            judge.judge(frame(tick), 50 * MS, still)
        return float(judge._belief.shares[ENCODERS.start])

    assert believed(-10.0) == believed(0.0)


def test_robots_that_lack_a_sensor_look_as_modelled_there() -> None:
    window = np.ones((2, WINDOW, CHANNELS))
    total, balance, _, second, _, motors, encoders = (blind(window.copy()) for blind in BLIND)
    assert (total[..., :2] == 0.0).all()
    assert (total[..., 2:] == 1.0).all()
    assert (balance[..., 1] == 0.0).all()
    assert balance.sum() == window.sum() - 2 * WINDOW
    assert (motors[..., 1:11] == 0.0).all()
    assert (motors[..., 11:] == 1.0).all()
    assert (encoders[..., [5, 6, 7, 11, 12, 13]] == 0.0).all()
    assert (encoders[..., [8, 9, 10]] == 1.0).all()
    # Without wheel 2's: the balance, both residuals and what it draws.
    assert np.flatnonzero(second[0, 0] == 0.0).tolist() == [1, 3, 6, 9]
    assert by_wheel(window).shape == (2, 3, INPUTS)


@pytest.mark.parametrize("hz", [5, 10, 20, 40, 100])
def test_what_is_named_does_not_hang_on_the_rate_of_decisions(hz: int) -> None:
    period, start = 1000 // hz, 2000

    def at(ms: int) -> ResidualFrame:
        found = frame(0, ALL, **(LOST if ms > start else {}))
        return evolve(found, stamp_ns=BASE + ms * MS)

    found = run([at(ms) for ms in range(period, 4000, period)])
    (named,) = [d for d in found if d.changed and d.state.name not in FAULTLESS]
    assert named.state is STATES[MOTOR + 1]
    assert (named.stamp_ns - BASE) // MS - start <= 300 + period


def test_after_a_gap_one_tick_counts_once() -> None:
    """Not as often as would have fitted into the gap."""
    healthy = [frame(tick) for tick in range(1, 40)]
    (*_, last) = run([*healthy, frame(400, **LOST)])
    assert last.state is STATES[NORMAL]


@pytest.mark.parametrize("hz", [5, 10, 20, 40, 100])
def test_an_idle_wheel_is_idle_after_half_a_second_at_any_rate(hz: int) -> None:
    period = 1000 // hz
    watch, found = MotionWatch(), []
    for ms in range(period, 2000, period):
        found.append(watch.take(evolve(frame(0, IDLE), stamp_ns=BASE + ms * MS)))
    first = next(k for k, unseen in enumerate(found) if unseen.wheels == (0,))
    assert 450 <= first * period < 450 + period


def test_damaged_weights_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "weights.npz"
    file.write_bytes(b"no zip")
    with pytest.raises(InputError, match="train it again"):
        WindowNetwork.load(file)
    np.savez(file, **{name: np.zeros(3) for name in ("weight_1", "bias_1", "weight_2", "bias_2")})
    with pytest.raises(InputError, match="set classifier to the kind"):
        WindowNetwork.load(file)
    with pytest.raises(InputError, match="no weights of the window network"):
        make_judge(
            evolve(
                ClassifierSettings(),
                weights=str(files("tomr_fault_diag") / "weights" / "wang2024.npz"),
            )
        )


def test_channels_of_a_frame_are_those_of_arrays() -> None:
    random = np.random.default_rng(1)
    values = random.normal(0.0, 3.0, (10, 3))
    values[[2, 5], 0] = NAN
    values[6] = NAN
    residuals = tuple(Residual(r, abs(b), m) for r, b, m in values.tolist())
    found = channels_of(ResidualFrame(BASE, residuals))
    expected = channels(values[:, 0], np.abs(values[:, 1]), values[:, 2])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_ratios_to_bands_are_those_of_the_frame() -> None:
    item = frame(0, ALL, (0.1, -0.3, 0.02), (1.0, -6.0, 0.5), (0.2, 0.0, math.nan))
    want = [item.residuals[0], *item.residuals[1:4], *item.residuals[7:10], *item.residuals[4:7]]
    ratios = np.nan_to_num([one.residual / one.band for one in want])
    ways = np.array([1.0] * 7 + [1.0, -1.0, 1.0])  # speeds as the wheels turn
    assert band_ratios(channels_of(item)) == pytest.approx(ratios * ways)


def _says(hypothesis: int, newest: float) -> np.ndarray:
    """What a network that sees 10 nats for a hypothesis says, the motors of the newest tick so many
    bands off."""
    network = WindowNetwork.load()
    seen = np.full(HYPOTHESES, -3.0)
    seen[[0, hypothesis]] = 0.0, 10.0
    stub = evolve(network, prior=np.ones(HYPOTHESES))
    window = np.zeros((WINDOW, CHANNELS))
    window[-1, 2] = np.arcsinh(3.0 * newest)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(WindowNetwork, "scores_of", lambda *_: seen)
        return stub.log_likelihoods(window)


def test_a_window_says_no_more_than_its_newest_tick_allows() -> None:
    # One motor a third of a band off: (3.3 / 3)^2 / 2 = 0.605 nats, and all in proportion.
    said = _says(2, 1.0 / 3.0)
    assert said[2] == pytest.approx(0.605)
    assert said[0] == 0.0
    assert said[5] == pytest.approx(-0.1815)
    assert _says(2, 0.0)[2] == 0.0
    assert _says(2, 2.0)[2] == pytest.approx(10.0)  # 21.8 would be allowed
    assert _says(14, 0.0)[14] == pytest.approx(10.0)  # a power sensor is slightly off, for long
