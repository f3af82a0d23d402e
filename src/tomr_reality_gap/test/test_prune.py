"""Second thoughts about findings: by a table of what each set of them is worth."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace

import numpy as np
import pytest

from tomr_reality_gap.fit import prune
from tomr_reality_gap.fit.refine import Fitted
from tomr_reality_gap.fit.search import Found
from tomr_reality_gap.fit.study import Model
from tomr_reality_gap.hypotheses.knobs import Hypothesis, Knob, Turned

WORTH: Mapping[str, float] = {
    "": 0.0,
    "a": 500.0,
    "b": 300.0,
    "c": 200.0,
    "d": 250.0,
    "ab": 900.0,
    "ac": 905.0,
    "bc": 400.0,
    "abc": 910.0,
    "ad": 1000.0,
    "bd": 310.0,
}
EMPTY = Model(Turned({}, "made"), (), ())


def _model(names: str) -> Model:
    model = EMPTY
    for name in names:
        knob = Knob("size", (name,), "", 1.0, 0.1)
        model = model.joined(Hypothesis(name, ("body",), (knob,)))
    return model


def _letters(model: Model) -> str:
    return "".join(item.effect for item in model.hypotheses)


def _fitted(model: Model) -> Fitted:
    worth = WORTH["".join(sorted(_letters(model)))]
    none = np.empty(0)
    return Fitted(model, worth, 0.0, none, none, none)


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> object:
    """`second(best, rounds)`: what second thoughts leave; rounds as (so far, tried together)."""

    def refine(
        study: object, states: Sequence[tuple[Model, object]], *rest: object
    ) -> list[Fitted]:
        return [_fitted(model) for model, _ in states]

    monkeypatch.setattr(prune, "refine", refine)
    study = SimpleNamespace(value=np.zeros(1000))

    def think(best: str, *rounds: tuple[str, str]) -> Found:
        steps = tuple(
            SimpleNamespace(
                columns=SimpleNamespace(model=_model(so_far)),
                tried=tuple(_fitted(_model(so_far + letter)) for letter in tried),
            )
            for so_far, tried in rounds
        )
        start = Found(_fitted(_model(best)), _fitted(EMPTY), steps, None)  # type: ignore[arg-type]
        return prune.second_thoughts(study, start)  # type: ignore[arg-type]

    return think


def test_a_finding_that_later_ones_made_needless_goes(second) -> None:  # type: ignore[no-untyped-def]
    """Of abc = 910 the weakest is b: ac alone is worth 905, less than the cost of 20 apart."""
    found = second("abc", ("", "ab"), ("a", "b"), ("ab", "c"))
    assert _letters(found.best.model) == "ac"


def test_what_a_finding_displaced_may_take_its_place(second) -> None:  # type: ignore[no-untyped-def]
    """d lost against b beside nothing, but beside a it is worth more."""
    found = second("ab", ("", "ab"), ("a", "bd"))
    assert _letters(found.best.model) == "ad"
    assert [_letters(item.model) for item in found.alternatives[1]] == ["ad", "ab"]


def test_needed_findings_stay_and_their_rivals_are_told(second) -> None:  # type: ignore[no-untyped-def]
    found = second("ab", ("", "ab"), ("a", "bc"))
    assert _letters(found.best.model) == "ac"  # 905 against 900
    assert _letters(found.alternatives[0][0].model) == "ac"
