"""What a report says of each finding: the evidence that it brings, and who its rivals are."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.linear_gaussian import Gram
from tomr_power_model.estimation.parameter import ParameterisedRobot
from tomr_reality_gap.findings import log_odds_of
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.fit.unmodelled import Remainder, gains
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

SAMPLES = 300


def _fitted(evidence: float, *effects: str) -> FittedModel:
    model, none = Model(ParameterisedRobot({}, "made"), (), ()), np.empty(0)
    for effect in effects:
        model = model.joined(Hypothesis(effect, ("body",), ()))
    return FittedModel(model, evidence, 0.0, none, none, none)


def test_rivals_stand_in_the_place_of_the_finding_whatever_else_was_kept() -> None:
    """Of a and b the group for b was made; a is none, as the user's simulation shows it too."""
    group = [_fitted(100.0, "a", "b"), _fitted(98.0, "a", "c"), _fitted(40.0, "a", "d")]
    alone = group[0].model.hypotheses[1]
    assert [(odd, other.effect) for odd, other in log_odds_of(alone, group)] == [
        (-2.0, "c"),
        (-60.0, "d"),
    ]
    assert log_odds_of(alone, ()) == []


def test_each_finding_has_the_evidence_that_is_lost_without_it() -> None:
    """Half of the energy that nothing else explains; the other finding explains half of each."""
    random = np.random.default_rng(3)
    columns = random.standard_normal((SAMPLES, 3))  # one nuisance, two findings
    columns[:, 2] += columns[:, 1]
    residual = 0.1 * random.standard_normal(SAMPLES)
    ones = np.ones(SAMPLES)
    rest = Remainder(None, residual, columns, ones, Gram.of(columns, residual))  # type: ignore[arg-type]
    jacobian = SimpleNamespace(own=(slice(1, 2), slice(2, 3)))
    changes = [4.0 * columns[:, 1], 2.0 * columns[:, 2]]
    found = gains(rest, jacobian, changes)  # type: ignore[arg-type]
    assert found == pytest.approx([0.25 * (change @ change) for change in changes], rel=0.1)
