"""What the data can hardly distinguish from a finding, from responses made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve, frozen

from tomr_power_model.estimation.parameter import Parameter
from tomr_reality_gap.fit.rivals import Responses
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

SAMPLES = 2000
RANDOM = np.random.default_rng(7)
NUISANCE, SHOWN, OTHER = RANDOM.standard_normal((3, SAMPLES))


def _hypothesis(name: str, **changes: object) -> Hypothesis:
    """One size, from nothing up; `changes` are its parameter's."""
    given = {"lower": 0.0, "upper": 100.0, **changes}
    return Hypothesis(name, ("body",), (Parameter("size", (name,), "", 1.0, **given),))  # type: ignore[arg-type]


@frozen
class _Model:
    """As far as rivals look at one."""

    hypotheses: tuple[Hypothesis, ...]
    offsets: tuple[tuple[float, ...], ...] = ()

    @property
    def names(self) -> set[str]:
        return {item.name for item in self.hypotheses}

    @property
    def described(self) -> SimpleNamespace:
        return SimpleNamespace(robot=self.hypotheses)

    def without(self, number: int) -> "_Model":
        return self.kept([place != number for place in range(len(self.hypotheses))])

    def kept(self, wanted: list[bool]) -> "_Model":
        pairs = zip(self.hypotheses, wanted, strict=True)
        return evolve(self, hypotheses=tuple(item for item, is_wanted in pairs if is_wanted))

    def swapped(self, number: int, item: Hypothesis, offsets: tuple[float, ...]) -> "_Model":
        changed = list(self.hypotheses)
        changed[number] = item
        return _Model(tuple(changed), (offsets,))


def _nearest(
    *shown: tuple[Hypothesis, np.ndarray], size: float = 3.0, searched: int = 0, findings: int = 1
) -> list[_Model]:
    """Rivals of the first, of which so much is in the data; the first column is a nuisance.

    So many others were in the last model that was searched from, and are no candidates there. With
    two findings the second is in the data as well, and what stands in is sought for both.
    """
    hypotheses, columns = zip(*shown, strict=True)
    by_name = {item.name: column for item, column in shown}
    matrix = np.stack([NUISANCE, *columns], axis=1)
    explained = size * np.sum(columns[:findings], axis=0)
    value = explained + RANDOM.standard_normal(SAMPLES)
    places = {item.key: slice(row, row + 1) for row, item in enumerate(hypotheses, start=1)}
    model = _Model(hypotheses[:findings])
    jacobian = SimpleNamespace(
        matrix=matrix,
        sensors=slice(1, 1),
        model=_Model(hypotheses[1 : 1 + searched]),
        own=[places.pop(item.key) for item in hypotheses[1 : 1 + searched]],
        candidates=places,
    )
    best = SimpleNamespace(model=model, value=explained)

    def predict(robots: list[tuple[Hypothesis, ...]]) -> list[np.ndarray]:
        return [
            sum((size * by_name[item.name] for item in robot), np.zeros(SAMPLES))
            for robot in robots
        ]

    responses = Responses(
        SimpleNamespace(predict=predict, value=value),  # type: ignore[arg-type]
        SimpleNamespace(
            rounds=[SimpleNamespace(jacobian=jacobian)],
            noise=SimpleNamespace(weight=np.ones(SAMPLES)),
        ),  # type: ignore[arg-type]
        hypotheses,
    )
    return responses.nearest(best, *range(findings))  # type: ignore[arg-type, return-value]


def test_what_spans_nearly_the_same_is_a_rival_with_the_size_that_stands_in() -> None:
    """At 1 and 3 degrees of the finding; a loss of 1/2 |d|^2 sin^2 of 2.7 and 25; at 90 of 9000."""
    found, near, far, none = map(_hypothesis, ("found", "near", "far", "none"))
    tried = _nearest(
        (found, SHOWN),
        (near, 2.0 * (SHOWN + 0.017 * OTHER)),
        (far, SHOWN - 0.052 * OTHER),
        (none, OTHER),
    )
    assert [model.hypotheses[0].effect for model in tried] == ["near", "far"]
    assert tried[0].offsets[0] == pytest.approx((1.5,), rel=0.02)


def test_what_only_nuisances_distinguish_is_a_rival() -> None:
    found, beside, near = map(_hypothesis, ("found", "beside", "near"))
    tried = _nearest((found, SHOWN), (beside, SHOWN + NUISANCE), (near, SHOWN + 0.03 * OTHER))
    assert [model.hypotheses[0].effect for model in tried] == ["beside", "near"]


def test_what_shows_what_two_findings_do_stands_in_for_both() -> None:
    """In the place of the first; what one of them shows is none of the other."""
    half, rest, whole = map(_hypothesis, ("half", "rest", "whole"))
    third = (_hypothesis("third"), SHOWN + 0.5 * OTHER)
    shown = ((half, SHOWN), (rest, OTHER), (whole, SHOWN + OTHER), third)
    tried = _nearest(*shown, findings=2)
    assert [[item.effect for item in model.hypotheses] for model in tried] == [["whole"]]
    assert tried[0].offsets[0] == pytest.approx((3.0,), rel=0.02)


def test_what_was_dropped_from_the_model_may_stand_in_as_well() -> None:
    found, gone, near = map(_hypothesis, ("found", "gone", "near"))
    shown = ((found, SHOWN), (gone, SHOWN + 0.017 * OTHER), (near, SHOWN + 0.03 * OTHER))
    tried = _nearest(*shown, searched=1)
    assert [model.hypotheses[0].effect for model in tried] == ["gone", "near"]


@pytest.mark.parametrize(
    "changes", [{"lower": -100.0, "upper": 0.0}, {"discrete_offset": 1.0}, {"upper": 2.0}]
)
def test_what_would_have_to_be_beyond_its_bounds_or_has_no_derivative_is_none(
    changes: dict[str, float],
) -> None:
    found, same = _hypothesis("found"), _hypothesis("same", **changes)
    assert _nearest((found, SHOWN), (same, SHOWN)) == []
