"""What findings, what is left and how much of it amount to; their makers are stand-ins."""

import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from tomr_reality_gap import verdict
from tomr_reality_gap.explanation import Explanation, Finding

from .conftest import comparison, finding

Judged = Callable[..., Explanation]


class _Model:
    """Hypotheses by name; `described` says which are left."""

    def __init__(self, *names: str) -> None:
        self.hypotheses = names
        self.described = SimpleNamespace(robot=names)

    def without(self, number: int) -> "_Model":
        return _Model(*(name for at, name in enumerate(self.hypotheses) if at != number))


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> Judged:
    """`judged(found names, left evidence, unexplained, size)`: the explanation."""

    def judge(
        *names: str,
        left: float = 0.0,
        unexplained: float = 0.0,
        size: float = 0.0,
        needed: list[bool] | None = None,
    ) -> Explanation:
        unnamed = SimpleNamespace(evidence=left, torque=None)
        answers: dict[str, object] = {
            "columns_at": None,
            "leftovers": [unnamed],
            "still_needed": needed,
            "without_needless": unnamed,
            "score_of": None,
            "_shares": [],
            "_variables": {},
            "_unexplained": (unexplained, size),
            "_left": unexplained,
            "_unnamed": evolve(finding(), effect="unknown", confidence=0.9),
            "_maps": (),
            "_alignment": {},
            "smallest": (),
            "_whiteness": {},
            "suggested": "",
        }
        for name, answer in answers.items():
            monkeypatch.setattr(verdict, name, lambda *_, _answer=answer: _answer)

        def found(evidence: object, number: int, *_: object) -> Finding:
            return evolve(finding(), effect=names[number])

        monkeypatch.setattr(verdict, "_finding", found)
        monkeypatch.setattr(verdict, "for_users", lambda _, model: model)
        monkeypatch.setattr(verdict, "described", lambda _, model: " ".join(model.hypotheses))
        best = SimpleNamespace(model=_Model(*names), evidence=1000.0 * len(names))
        evidence = SimpleNamespace(
            study=SimpleNamespace(simulations=(), predict=lambda robots: robots, value=()),
            mirror=None,
            runs=(),
            simulated=(None, None),
            found=SimpleNamespace(best=best, without=SimpleNamespace(evidence=0.0)),
            base=SimpleNamespace(robot=()),
            nameless=None,
        )
        return verdict.explanation_of(evidence, (), ())  # type: ignore[arg-type]

    return judge


def effects(explanation: Explanation) -> list[str]:
    return [item.effect for item in explanation.findings]


def test_nothing_found_and_nothing_left_is_a_match(judged: Judged) -> None:
    found = judged(unexplained=0.9, size=2.0)  # noise that is slow
    assert (found.verdict, effects(found), found.explained) == ("match", [], "")


def test_what_was_found_goes_into_the_description(judged: Judged) -> None:
    found = judged("friction.viscous", "body.slope", unexplained=0.1, size=0.3)
    assert found.verdict == "mismatch"
    assert effects(found) == ["friction.viscous", "body.slope"]
    assert found.explained == "friction.viscous body.slope"
    assert found.findings[0].confidence == finding().confidence


def test_names_that_leave_much_are_doubted(judged: Judged) -> None:
    found = judged("friction.viscous", unexplained=0.5, size=2.0)
    assert effects(found) == ["friction.viscous", "unknown"]
    assert found.findings[0].confidence < 0.5
    assert found.unexplained_share == 0.5


@pytest.mark.parametrize(("unexplained", "size"), [(0.5, 0.8), (0.2, 5.0)])
def test_a_small_rest_casts_no_doubt(judged: Judged, unexplained: float, size: float) -> None:
    """Small against the noise, or against what was explained."""
    found = judged("friction.viscous", unexplained=unexplained, size=size)
    assert effects(found) == ["friction.viscous"]
    assert found.findings[0].confidence > 0.9


def test_much_more_than_noise_without_any_name_is_no_match(judged: Judged) -> None:
    found = judged(unexplained=0.9, size=50.0)
    assert (found.verdict, effects(found)) == ("mismatch", ["unknown"])
    assert found.explained == ""


def test_what_has_no_name_takes_the_place_of_names_that_it_makes_needless(judged: Judged) -> None:
    found = judged("friction.viscous", "body.slope", left=500.0, needed=[False, True])
    assert effects(found) == ["body.slope", "unknown"]
    assert found.explained == "body.slope"


def _fitted(evidence: float, effect: str) -> SimpleNamespace:
    hypothesis = SimpleNamespace(effect=effect, where=("all_wheels",), name=effect)
    return SimpleNamespace(evidence=evidence, model=SimpleNamespace(hypotheses=(hypothesis,)))


def test_rivals_are_what_comes_within_five_of_log_evidence() -> None:
    group = [
        _fitted(100.0, "friction.coulomb"),
        _fitted(97.0, "contact.rolling_resistance"),
        _fitted(88.0, "friction.viscous"),
    ]
    rivals, confidence = verdict._rivals(0, group)  # type: ignore[arg-type]
    assert [(rival.effect, rival.log_odds) for rival in rivals] == [
        ("contact.rolling_resistance", pytest.approx(-3.0))
    ]
    near, rest = 1.0 + math.exp(-1.0), math.exp(-4.0)
    assert confidence == pytest.approx(0.97 * near / (near + rest))


def test_what_is_left_counts_beyond_noise_and_a_part_of_the_spread() -> None:
    """Wheel 2 draws 1.2 W more for six of sixty seconds: after, nothing is left."""
    made = comparison("made", False, 1)
    before, after = np.concatenate(made.before), np.concatenate(made.after)
    study = SimpleNamespace(channels=made.channels)
    evidence = SimpleNamespace(study=study, simulated=(before, after))
    share, size = verdict._unexplained(evidence, before)  # type: ignore[arg-type]
    assert share == pytest.approx(1.0)
    assert size > 1.0
    share, size = verdict._unexplained(evidence, after)  # type: ignore[arg-type]
    assert share < 0.05
    assert size < 0.1
