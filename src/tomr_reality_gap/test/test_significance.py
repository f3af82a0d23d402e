"""Which findings are distinguished from nothing, on models made by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.parameter import Parameter
from tomr_reality_gap import explain
from tomr_reality_gap.fit import significance
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.significance import distances, significant
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

MASS = Parameter("value", ("robot.mass",), "kg", 0.5)
TORQUE = Parameter("torque", ("physics.friction.stribeck.torque",), "N m", 0.1)
SPEED = Parameter("speed", ("physics.friction.stribeck.speed",), "rad/s", 1.0, is_shape=True)
LATER = Parameter("value", ("controller.integrator",), "", 1.0, discrete_offset=1.0)


def _model(*pairs: tuple[Hypothesis, tuple[float, ...]], nuisance: float = 0.0) -> Model:
    base = SimpleNamespace(values={"robot.mass": 15.0, "controller.integrator": 0.0})
    return Model(
        base,  # type: ignore[arg-type]
        (MASS,),
        (nuisance,),
        tuple(item for item, _ in pairs),
        tuple(offsets for _, offsets in pairs),
    )


def _hypothesis(*parameters: Parameter, **start: float) -> Hypothesis:
    return Hypothesis("made", ("body",), parameters, start=start)


@pytest.mark.parametrize(
    ("offset", "nuisance", "expected"),
    [(0.49, 0.0, 0.5), (-1.96, 0.0, 2.0), (1.0, -1.0, 0.0), (0.49, 0.49, 1.0)],
)
def test_a_value_is_as_far_from_the_described_one_as_its_tolerance_leaves_it(
    offset: float, nuisance: float, expected: float
) -> None:
    """Half of an interval: 1.96 times 0.5 kg."""
    model = _model((_hypothesis(MASS), (offset,)), nuisance=nuisance)
    assert distances(model, np.array([0.5])) == pytest.approx([expected])


def test_of_several_parameters_the_clearest_size_counts_and_no_shape() -> None:
    """0.03 N m known to 0.01, at a speed that is hardly known or sure."""
    hypothesis = _hypothesis(TORQUE, SPEED, **{SPEED.keys[0]: 0.9})
    model = _model((hypothesis, (0.03, 5.0)))
    assert distances(model, np.array([0.01, 0.1])) == pytest.approx([3.0 / 1.96])
    assert distances(model, np.array([0.01, 9.9])) == pytest.approx([3.0 / 1.96])


def test_what_starts_beyond_nothing_is_that_far_from_it() -> None:
    hypothesis = _hypothesis(TORQUE, **{TORQUE.keys[0]: 0.05})
    assert distances(_model((hypothesis, (0.0,))), np.array([0.01])) == pytest.approx([5.0 / 1.96])


def test_an_alternative_that_is_no_size_is_not_judged() -> None:
    assert distances(_model((_hypothesis(LATER), (1.0,))), np.array([9.9])) == [math.inf]


def test_what_stands_in_is_sought_anew_until_nothing_more_is_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One goes as it may be nothing, one as the user's simulation shows it; then all is sure."""

    def selection(*names: str) -> SimpleNamespace:
        return SimpleNamespace(best=SimpleNamespace(model=SimpleNamespace(hypotheses=names)))

    def without(name: str, found: SimpleNamespace) -> SimpleNamespace:
        return selection(*(n for n in found.best.model.hypotheses if n != name))

    anew: list[tuple[str, ...]] = []

    def eliminated(_: object, found: SimpleNamespace, *__: object) -> SimpleNamespace:
        anew.append(found.best.model.hypotheses)
        return selection(*("better" if n == "a" else n for n in found.best.model.hypotheses))

    monkeypatch.setattr(explain, "significant", lambda _, found, __: without("weak", found))
    monkeypatch.setattr(
        explain, "beyond_baseline", lambda _, found, *__: (without("theirs", found), "shared")
    )
    monkeypatch.setattr(explain, "backward_elimination", eliminated)
    given = selection("a", "weak", "theirs", "b")
    kept, shared = explain._held(None, given, (), None, lambda _: None)  # type: ignore[arg-type]
    assert (kept.best.model.hypotheses, shared) == (("better", "b"), "shared")
    assert anew == [("a", "b")]


def test_what_a_finding_explains_is_what_leaving_it_out_adds() -> None:
    """Measured 2 and 2, of noises 1 and 0.5; without either 1 is left."""
    shown = {"both": [2.0, 2.0], "a": [1.0, 2.0], "b": [2.0, 1.5]}

    class Made:
        hypotheses = ("a", "b")
        described = SimpleNamespace(robot="both")

        def without(self, number: int) -> SimpleNamespace:
            return SimpleNamespace(described=SimpleNamespace(robot="ab"[1 - number]))

    dataset = SimpleNamespace(
        value=np.array([2.0, 2.0]), predict=lambda robots: np.array([shown[r] for r in robots])
    )
    noise = SimpleNamespace(weight=np.array([1.0, 2.0]))
    found = SimpleNamespace(best=SimpleNamespace(model=Made()), noise=noise)
    assert significance.energies(dataset, found) == [1.0, 1.0]  # type: ignore[arg-type]


def _selected(
    monkeypatch: pytest.MonkeyPatch, away: dict[str, float], useless: tuple[str, ...] = ()
) -> list[str]:
    """Names that are left of some, by how far they are from nothing; `useless` explain nothing."""
    found = SimpleNamespace(best=SimpleNamespace(model=SimpleNamespace(hypotheses=list(away))))

    def dropped(_: object, found: SimpleNamespace, number: int, tick: object) -> SimpleNamespace:
        names = [n for k, n in enumerate(found.best.model.hypotheses) if k != number]
        return SimpleNamespace(best=SimpleNamespace(model=SimpleNamespace(hypotheses=names)))

    monkeypatch.setattr(significance, "linearise", lambda *_: None)
    monkeypatch.setattr(significance, "own_sigma", lambda *_: None)
    monkeypatch.setattr(significance, "dropped", dropped)
    monkeypatch.setattr(
        significance, "distances", lambda model, _: [away[name] for name in model.hypotheses]
    )
    monkeypatch.setattr(
        significance,
        "energies",
        lambda _, found: [-1.0 * (n in useless) or 9.0 for n in found.best.model.hypotheses],
    )
    left = significant(None, found)  # type: ignore[arg-type]
    return list(left.best.model.hypotheses)


@pytest.mark.parametrize(
    ("away", "left"),
    [
        ({"a": 5.0, "b": 1.54}, ["a", "b"]),  # three standard deviations
        ({"a": 5.0, "b": 1.52, "c": 0.2}, ["a"]),
        ({"a": 0.5, "b": 0.2}, []),
        ({"a": 1.52}, []),  # also one alone
        ({"a": 1.54}, ["a"]),
        ({}, []),
    ],
)
def test_findings_that_may_be_nothing_go_the_least_certain_first(
    monkeypatch: pytest.MonkeyPatch, away: dict[str, float], left: list[str]
) -> None:
    assert _selected(monkeypatch, away) == left


def test_what_explains_nothing_goes_first_and_even_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _selected(monkeypatch, {"a": 9.0}, ("a",)) == []
    assert _selected(monkeypatch, {"a": 9.0, "b": 1.6}, ("a",)) == ["b"]
