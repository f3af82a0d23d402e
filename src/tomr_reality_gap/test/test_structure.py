"""How far values may be off for what is not named, from responses made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.estimation.parameter import Parameter
from tomr_reality_gap.fit.structure import Addition, additions_of, structural_shifts
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

SAMPLES = 4000
COSINE = 0.6  # between what the finding and what the unnamed show
RANDOM = np.random.default_rng(11)
# Orthogonal to each other, each of length one.
FIRST, SECOND, EDGE, NOISE = np.linalg.qr(RANDOM.standard_normal((SAMPLES, 4)))[0].T
STD = 0.5  # prior standard deviation of the finding's size
FOUND = 100.0 * FIRST
UNNAMED = 100.0 * (COSINE * FIRST + 0.8 * SECOND)


def _hypothesis(name: str, std: float = 1.0, **changes: object) -> Hypothesis:
    given = {"lower": -100.0, "upper": 100.0, **changes}
    return Hypothesis(name, ("body",), (Parameter("size", (name,), "", std, **given),))  # type: ignore[arg-type]


def _additions(*candidates: Hypothesis, size: float, at_edge: bool = False) -> list[Addition]:
    """Of a finding at 3 prior standard deviations beside what is not named, of so many of its own.

    A nuisance shows what the unnamed does beside the finding; it may be held at its edge.
    """
    finding = _hypothesis("finding", STD)
    nuisance = Parameter("tolerance", ("nuisance",), "", 1.0, lower=-0.1, upper=0.1)
    model = SimpleNamespace(
        hypotheses=(finding,),
        names={"finding at body"},
        own=finding.parameters,
        nuisances=(nuisance,),
        nuisance_offsets=(0.1 if at_edge else 0.0,),
        own_offsets=(3.0 * STD,),
    )
    # What is left is what the finding cannot make up for: it has taken the rest already.
    left = size * 100.0 * 0.8 * SECOND
    slices = {item.key: slice(2 + row, 3 + row) for row, item in enumerate(candidates)}
    responses = {"unnamed at body": UNNAMED, "elsewhere at body": 100.0 * NOISE}
    columns = [responses.get(item.name, UNNAMED) for item in candidates]
    nuisance_column = 100.0 * (SECOND if at_edge else EDGE)
    kept = np.stack([nuisance_column, FOUND], axis=1)
    jacobian = SimpleNamespace(
        matrix=kept, model=model, nuisance=slice(0, 1), sensors=slice(1, 1), kept=2
    )
    last = SimpleNamespace(matrix=np.column_stack([kept, *columns]), kept=2, candidates=slices)
    best = SimpleNamespace(model=model, value=np.zeros(SAMPLES), sensors=np.empty(0))
    found = SimpleNamespace(
        best=best,
        rounds=[SimpleNamespace(jacobian=last)],
        noise=SimpleNamespace(weight=np.ones(SAMPLES)),
    )
    dataset = SimpleNamespace(value=left)
    return list(additions_of(dataset, found, jacobian, candidates))  # type: ignore[arg-type]


def test_a_value_is_off_by_what_it_makes_up_for() -> None:
    """Of 0.5 units that are not named the finding has taken the share that it shows as well."""
    (found,) = _additions(_hypothesis("unnamed", lower=0.0, upper=0.1), size=0.5)
    assert found.shift == pytest.approx([-0.5 * COSINE * STD], rel=1e-3)
    (other,) = _additions(_hypothesis("unnamed", lower=0.0, upper=0.1), size=-0.5)
    assert other.shift == pytest.approx(-found.shift, rel=1e-2)  # whatever it is, of either sign
    # Half of what is left, 40^2, less the cost of a parameter that the data know well, and what
    # offsets cost before and after.
    prior = 0.5 * (3.0**2 - 2.7**2 - 0.5**2)
    assert found.gain == pytest.approx(0.5 * 40.0**2 - np.log(80.0) + prior, abs=0.01)


def test_what_is_less_likely_beforehand_gains_less() -> None:
    likely, unlikely = (
        _additions(evolve(_hypothesis("unnamed"), log_prior=prior), size=0.5)[0].gain
        for prior in (0.0, -5.0)
    )
    assert likely - unlikely == pytest.approx(5.0)


def test_what_shows_otherwise_moves_nothing() -> None:
    (found,) = _additions(_hypothesis("elsewhere"), size=0.5)
    assert found.shift == pytest.approx([0.0], abs=1e-6)
    assert found.gain < 0.0


def test_a_nuisance_at_its_edge_makes_up_for_nothing() -> None:
    (found,) = _additions(_hypothesis("unnamed"), size=0.5, at_edge=True)
    assert found.shift == pytest.approx([-0.5 * COSINE * STD], rel=1e-3)


def test_what_cannot_be_added_is_not() -> None:
    """A whole alternative, what is named, and what changes the same."""
    same = Hypothesis("other name", ("body",), (Parameter("size", ("finding",), "", 1.0),))
    barred = [
        _hypothesis("unnamed", discrete_offset=0.5),
        _hypothesis("finding"),
        same,
    ]
    assert [_additions(item, size=0.5) for item in barred] == [[]] * len(barred)


def _addition(gain: float, *shift: float) -> Addition:
    return Addition(_hypothesis("unnamed"), gain, np.array(shift))


@pytest.mark.parametrize(
    ("additions", "expected"),
    [
        ([], [0.0, 0.0]),
        ([_addition(30.0, 0.2, -0.1), _addition(90.0, -0.1, 0.3)], [0.2, 0.3]),
        ([_addition(19.0, 0.2, -0.1)], [0.0, 0.0]),  # a name would cost more
        ([_addition(90.0, -1.1, 0.3)], [0.0, 0.0]),  # it would take the first finding away
        ([_addition(90.0, 0.2, 2.5), _addition(30.0, 0.1, 0.1)], [0.1, 0.1]),
    ],
)
def test_the_largest_shift_counts_that_the_recordings_want(
    additions: list[Addition], expected: list[float]
) -> None:
    found = structural_shifts(additions, np.array([1.0, -2.0]))
    assert found == pytest.approx(np.array(expected))
