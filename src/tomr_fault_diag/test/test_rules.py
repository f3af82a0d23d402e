"""What a window's log-likelihoods count for, rule by rule, in numbers worked by hand."""

import math

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
    WEAKS,
    of_states,
)
from tomr_fault_diag.classifier.contacts import Contacts
from tomr_fault_diag.classifier.evidence import Beside
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.outside import Outside
from tomr_fault_diag.classifier.parity import Parity
from tomr_fault_diag.classifier.rules import ALL_RULES, STATE_RULES, WINDOW_RULES, Moment
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_fault_diag.residuals.frame import ENCODERS as DERIVED
from tomr_fault_diag.residuals.frame import (
    MOTORS,
    RESIDUALS,
    SPEEDS,
    Residual,
    ResidualFrame,
)

Array = NDArray[np.float64]

FRAME = ResidualFrame(1_000_000_000, (Residual(0.0, 1.0, 1.0, "W"),) * RESIDUALS)
QUIET = Moment(FRAME)
LIKELY = np.arange(HYPOTHESES, dtype=float)  # the later the likelier


def speeds(off: float, *, stale: bool = False) -> ResidualFrame:
    """All speeds so many bands off, or unknown."""
    residuals = list(FRAME.residuals)
    for channel in SPEEDS:
        found = Residual(math.nan if stale else off, 1.0, 5.0, "rad/s")
        residuals[channel] = evolve(found, missing="no encoders") if stale else found
    return evolve(FRAME, residuals=tuple(residuals))


def beside(contacts: Contacts | None = None, outside: Outside | None = None) -> Moment:
    """A moment of which so much is known."""
    return evolve(QUIET, beside=Beside(contacts or Contacts(), outside or Outside()))


def changed(name: str, moment: Moment, given: Array = LIKELY) -> dict[int, float]:
    """What a rule adds, by hypothesis or state."""
    rules = {**WINDOW_RULES, **STATE_RULES}
    states = given if name in WINDOW_RULES else of_states(given)
    kept = states.copy()
    found = rules[name](states, moment)
    assert np.array_equal(states, kept)  # what it was given stays as it is
    return {int(at): float(found[at] - states[at]) for at in np.flatnonzero(found != states)}


@pytest.mark.parametrize(
    "name", [one for one in WINDOW_RULES if one != "a description that is off"]
)
def test_a_rule_of_windows_says_nothing_where_nothing_is_known(name: str) -> None:
    assert changed(name, QUIET) == {}


@pytest.mark.parametrize("name", STATE_RULES)
def test_a_rule_of_states_says_nothing_where_nothing_is_known(name: str) -> None:
    assert changed(name, QUIET) == {}


def test_a_motor_without_power_of_its_own_is_neither_accused_nor_cleared() -> None:
    moment = evolve(QUIET, unseen=Unseen(blind=((1, ""),)))
    normal = evolve(moment, frame=FRAME)
    faults = [kind.start + 1 for kind in (CONTROLS, ENCODERS, DRAGS, WEAKS, METERS)]
    assert changed("a blind motor", normal) == {at: float(-at) for at in faults}
    accused = np.where(np.arange(HYPOTHESES) == ENCODERS.start + 1, 9.0, 1.0)
    assert set(changed("a blind motor", normal, accused)) == set(range(HYPOTHESES))


def test_what_an_idle_wheel_hides_it_does_not_refute() -> None:
    moment = evolve(QUIET, unseen=Unseen(wheels=(2,)))
    against = -LIKELY
    hidden = [kind.start + 2 for kind in (CONTROLS, ENCODERS, DRAGS, WEAKS)]
    assert changed("an idle wheel", moment, against) == {at: float(at) for at in hidden}
    assert changed("an idle wheel", moment) == {}  # but it may speak for it


def test_no_fault_turns_a_wheel_that_stood_where_others_are_driven() -> None:
    """But for a lost signal where other wheels pull it along."""
    moment = evolve(QUIET, unseen=Unseen(moved=(0,), driven=True))
    kinds = ENCODERS, DRAGS, WEAKS
    assert set(changed("a wheel that is moved", moment)) == {kind.start for kind in kinds}


@pytest.mark.parametrize("channel", [MOTORS.start, DERIVED.start])
@pytest.mark.parametrize(
    ("drawn", "pushed"), [(-5.0, True), (0.9, True), (1.1, False), (math.nan, True)]
)
def test_what_is_not_known_turns_a_wheel_that_stood_only_where_it_draws_more(
    channel: int, drawn: float, pushed: bool
) -> None:
    residuals = list(FRAME.residuals)
    residuals[channel] = evolve(residuals[channel], residual=drawn)
    frame = evolve(FRAME, residuals=tuple(residuals))
    moment = evolve(QUIET, frame=frame, unseen=Unseen(moved=(0,)))
    found = changed("a wheel that is moved", moment)
    assert found.pop(OTHER, 0.0) == (-1.0 if pushed else 0.0)  # no likelier than a push
    assert set(found) == {kind.start for kind in (CONTROLS, ENCODERS, DRAGS, WEAKS)}


@pytest.mark.parametrize(("unknown", "less"), [(3.0, {OTHER: -3.0}), (-4.0, {})])
def test_what_is_not_known_is_no_likelier_than_normal_where_a_push_is_not(
    unknown: float, less: dict[int, float]
) -> None:
    moment = evolve(QUIET, unseen=Unseen(moved=(0,)))
    given = np.where(np.arange(HYPOTHESES) == OTHER, unknown, 0.0)
    given[EXTERNAL] = -2.0
    assert changed("a wheel that is moved", moment, given) == less


def test_without_speeds_no_encoder_is_likelier_than_another() -> None:
    moment = evolve(QUIET, frame=speeds(0.0, stale=True))
    assert changed("no speeds", moment) == {ENCODERS.start: 2.0, ENCODERS.start + 1: 1.0}


def test_no_power_sensor_makes_a_wheel_turn_otherwise() -> None:
    moment = evolve(QUIET, frame=speeds(4.0))
    assert set(changed("a speed far off", moment)) == set(range(METERS.start, METERS.stop))
    assert changed("a speed far off", evolve(QUIET, frame=speeds(2.0))) == {}


def test_a_robot_that_stands_says_only_what_is_striking() -> None:
    unseen = Unseen(wheels=(0, 1, 2), slip=True)
    moment = evolve(QUIET, unseen=unseen, striking=9.0)
    assert set(changed("standing", moment)) == set(range(1, 9))


def test_what_a_description_that_is_off_says_slightly_is_not_counted() -> None:
    found = changed("a description that is off", QUIET, LIKELY / 10.0)
    # Log-likelihoods of 0.8 to 1.6: what is beyond 1 stays.
    assert found[DRAGS.start] == pytest.approx(-0.8)
    assert found[METERS.stop - 1] == pytest.approx(-1.0)
    assert set(found) == set(range(DRAGS.start, METERS.stop))


GRIPS = Contacts(0.0)


@pytest.mark.parametrize(
    ("moment", "nats"),
    [
        (beside(GRIPS), 0.0),  # forces alone do not show it of a robot that is not commissioned
        (evolve(beside(GRIPS), commissioned=True), -2.0),
        (evolve(beside(GRIPS), commissioned=True, is_well=False), 0.0),
        (evolve(beside(Contacts(0.0, calm=True)), commissioned=True, is_well=False), -2.0),
        (beside(evolve(GRIPS, felt=True)), -10.0),
        (beside(Contacts(0.5, felt=True)), 0.0),
        (evolve(QUIET, is_shaken=True), -2.0),
        (evolve(QUIET, is_shaken=True, by_gyro=np.eye(HYPOTHESES)[SLIP]), 0.0),
        (evolve(beside(evolve(GRIPS, felt=True)), by_forces=np.eye(HYPOTHESES)[SLIP]), 0.0),
    ],
)
def test_wheels_that_grip_do_not_slip(moment: Moment, nats: float) -> None:
    assert changed("wheels that grip", moment) == ({SLIP: nats} if nats else {})


@pytest.mark.parametrize(("is_shaken", "is_well"), [(True, True), (True, False), (False, True)])
def test_after_a_push_a_signal_seems_lost(is_shaken: bool, is_well: bool) -> None:
    moment = evolve(QUIET, is_shaken=is_shaken, is_well=is_well)
    faults = range(CONTROLS.start, CONTROLS.stop) if is_shaken and is_well else ()
    assert changed("a signal after a push", moment) == dict.fromkeys(faults, -2.0)


def test_small_faults_that_last_are_added_and_not_refuted() -> None:
    lasting = np.zeros(HYPOTHESES)
    lasting[WEAKS.start] = 0.5
    moment = evolve(QUIET, beside=Beside(lasting=lasting))
    name = "small faults that last"
    assert changed(name, moment) == {WEAKS.start: 0.5}
    assert changed(name, moment, -LIKELY) == {WEAKS.start: WEAKS.start + 0.5}
    assert changed(name, evolve(moment, is_shaken=True)) == {}


@pytest.mark.parametrize(("name", "by"), [("gyro", "by_gyro"), ("forces", "by_forces")])
def test_what_a_gyro_and_forces_say_is_added(name: str, by: str) -> None:
    said = np.eye(HYPOTHESES)[SLIP] * 7.0
    moment = evolve(QUIET, **{by: said})  # type: ignore[arg-type]
    assert changed(name, moment) == {SLIP: 7.0}


def test_a_load_is_likelier_than_all_else() -> None:
    name, most = "a load", of_states(LIKELY).max()
    found = changed(name, beside(outside=Outside(load=True)))
    assert found == {LOADED: pytest.approx(most + 24.0 - LIKELY[EXTERNAL])}
    assert changed(name, beside(outside=Outside(may_be_push=True))) == {LOADED: -10.0}
    assert LOADED in changed(name, beside(outside=Outside(load=True, may_be_push=True)))


@pytest.mark.parametrize("outside", [Outside(load=True), Outside(push=True)])
def test_a_force_on_the_body_accuses_no_wheel(outside: Outside) -> None:
    wheels = range(CONTROLS.start, METERS.stop)
    found = changed("a force on the body", beside(outside=outside))
    assert found == dict.fromkeys(wheels, pytest.approx(-10.0))


@pytest.mark.parametrize("name", ["a load", "a force on the body"])
def test_where_a_parity_broke_no_force_on_the_body_explains_it(name: str) -> None:
    found = Beside(outside=Outside(load=True), parity=Parity(broke=np.array([True, False, False])))
    assert changed(name, beside(outside=found.outside))
    assert not changed(name, evolve(QUIET, beside=found))


def test_what_breaks_a_parity_is_not_over() -> None:
    parity = Parity(breaks=np.array([False, True, False]))
    found = changed("a parity that breaks", evolve(QUIET, beside=Beside(parity=parity)))
    assert found == dict.fromkeys(range(ENDED.start, ENDED.stop), -24.0)


def test_commands_that_are_not_known_accuse_no_wheel_that_was_well() -> None:
    name, moment = "commands that are not known", beside()
    assert not changed(name, moment)
    moment = evolve(moment, beside=Beside(parity=Parity(misled=True)))
    less = [*range(CONTROLS.start, METERS.stop), OTHER]
    assert changed(name, moment) == dict.fromkeys(less, pytest.approx(-10.0))
    assert not changed(name, evolve(moment, is_well=False))
    assert not changed(name, evolve(moment, is_unaccused=False))


def test_who_leans_on_wheels_that_grip_makes_none_slip() -> None:
    name, leans = "a push and wheels that grip", Outside(may_be_push=True)
    assert changed(name, beside(GRIPS, leans)) == {SLIP: -10.0}
    assert changed(name, beside(Contacts(0.2), leans)) == {}


def test_what_a_slope_explains_accuses_no_wheel_that_was_well() -> None:
    moment = beside(Contacts(force=True))
    wheels = range(CONTROLS.start, WEAKS.stop)  # a power sensor feels no slope
    assert changed("a slope", moment) == dict.fromkeys(wheels, pytest.approx(-10.0))
    assert changed("a slope", evolve(moment, is_unaccused=False)) == {}
    some = Contacts(0.0, slopes=True)  # an accelerometer would know which
    assert changed("a slope", beside(some)) == changed("a slope", moment)
    assert changed("a slope", beside(evolve(some, felt=True))) == {}


def test_without_rules_the_network_alone_is_heard() -> None:
    rules = ALL_RULES
    for name in (*WINDOW_RULES, *STATE_RULES):
        rules = rules.without(name)
    moment = evolve(beside(GRIPS, Outside(load=True)), is_shaken=True, commissioned=True)
    assert np.array_equal(rules.weigh(LIKELY, moment), of_states(LIKELY))
    assert not np.array_equal(ALL_RULES.weigh(LIKELY, moment), of_states(LIKELY))


def test_one_rule_may_be_left_out_by_its_name() -> None:
    moment = evolve(QUIET, by_gyro=np.eye(HYPOTHESES)[SLIP])
    with_it, without = ALL_RULES.weigh(LIKELY, moment), ALL_RULES.without("gyro")
    assert with_it[SLIP] == without.weigh(LIKELY, moment)[SLIP] + 1.0
    with pytest.raises(KeyError, match="no such rule"):
        ALL_RULES.without("no such rule")


def test_states_are_as_many_as_the_belief_has() -> None:
    found = ALL_RULES.weigh(LIKELY, QUIET)
    assert found.shape == (ENDED.stop,)
    assert found[NORMAL] == 0.0
    assert found[OTHER] > LIKELY[OTHER] - math.log(2.0)  # any fault is one that is not known
