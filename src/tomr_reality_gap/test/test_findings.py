"""What a report says of each finding: its evidence, its rivals; and of what was not found."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot
from tomr_reality_gap import verdict
from tomr_reality_gap.analysis import detection_limits
from tomr_reality_gap.findings import Findings, log_odds_of
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.verdict import _sentence

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


def test_what_keeps_the_finding_beside_another_is_no_rival_of_it() -> None:
    """Coulomb with viscous friction is none of Coulomb friction; who does the work of both is."""
    group = [_fitted(100.0, "a", "b"), _fitted(99.0, "b", "a", "c"), _fitted(97.0, "i")]
    alone = group[0].model.hypotheses[0]
    assert [(odd, other.effect) for odd, other in log_odds_of(alone, group)] == [(-3.0, "i")]


def test_of_several_tries_of_a_rival_the_best_counts() -> None:
    """b was tried from two shapes; the last ended in a worse place."""
    group = [_fitted(100.0, "a"), _fitted(97.0, "b"), _fitted(20.0, "b")]
    found = log_odds_of(group[0].model.hypotheses[0], group)
    assert [(odd, other.effect) for odd, other in found] == [(-3.0, "b")]


def test_each_finding_has_the_evidence_that_is_lost_without_it() -> None:
    """Half of the energy that nothing else explains; the other finding explains half of each."""
    random = np.random.default_rng(3)
    columns = random.standard_normal((SAMPLES, 3))  # one nuisance, two findings
    columns[:, 2] += columns[:, 1]
    residual = 0.1 * random.standard_normal(SAMPLES)
    jacobian = SimpleNamespace(own=(slice(1, 2), slice(2, 3)), matrix=columns)
    changes = [4.0 * columns[:, 1], 2.0 * columns[:, 2]]
    zero = np.zeros(SAMPLES)
    analysis = SimpleNamespace(
        dataset=SimpleNamespace(value=residual),
        jacobian=jacobian,
        found=SimpleNamespace(
            best=SimpleNamespace(model=None, value=zero),
            noise=SimpleNamespace(weight=np.ones(SAMPLES)),
        ),
        simulated=(zero, zero, *(-change for change in changes)),
    )
    found = verdict.gains(analysis)  # type: ignore[arg-type]
    assert found == pytest.approx([0.25 * (change @ change) for change in changes], rel=0.1)


def test_the_smallest_that_would_have_been_seen_brings_just_its_cost() -> None:
    """One column of 300 samples of white noise, and a nuisance that shows half of it."""
    random = np.random.default_rng(4)
    nuisance, own = random.standard_normal((2, SAMPLES))
    matrix = np.stack([1e4 * nuisance, *(own + nuisance,) * 4], axis=1)
    size = Parameter("coefficient", ("made",), "N m s", 0.01)
    candidates = (
        Hypothesis("friction.viscous", ("all_wheels",), (size,)),
        Hypothesis("friction.quadratic", ("all_wheels",), (size,), least=0.5),
        Hypothesis("friction.viscous", ("wheel_1_joint",), (size,)),
        Hypothesis("parameter.robot.mass", ("body",), (size,)),
    )
    jacobian = SimpleNamespace(
        matrix=matrix,
        sensors=slice(0, 1),
        model=SimpleNamespace(names=frozenset()),
        candidates={item.key: slice(row, row + 1) for row, item in enumerate(candidates, 1)},
    )
    step = SimpleNamespace(jacobian=jacobian, noise=SimpleNamespace(weight=np.ones(SAMPLES)))
    analysis = SimpleNamespace(found=SimpleNamespace(rounds=(step,)), candidates=candidates)
    information = float(own @ own - (own @ nuisance) ** 2 / (nuisance @ nuisance))
    expected = 0.01 * math.sqrt(2.0 * (20.0 + math.log1p(information)) / information)
    assert detection_limits(analysis) == (  # type: ignore[arg-type]
        ("friction.viscous", "all_wheels", f"coefficient {expected:.2g} N m s"),
        ("friction.quadratic", "all_wheels", "coefficient 0.5 N m s"),
    )


@pytest.mark.parametrize("named", ["second", "parameter.made"])
def test_a_value_is_as_sure_as_noise_and_what_is_not_named_leave_it(named: str) -> None:
    """The second of two findings; the simulator is exact to 2 % of no offset at all."""
    size = Parameter("torque", ("made", "other"), "N m", 0.5)
    model = Model(ParameterisedRobot({"made": 0.5, "other": 1.5}, "made"), (), ())
    for effect in ("first", named):
        model = model.joined(Hypothesis(effect, ("body",), (size,)))
    analysis = SimpleNamespace(
        found=SimpleNamespace(best=SimpleNamespace(model=model)),
        base=model.base,
        own_sigma=np.array([9.0, 0.3]),
        structural_shifts=np.array([9.0, 1.96 * 0.4]),
        shared=(),
    )
    found = Findings(analysis, (), {})._parameters(1)["torque"]  # type: ignore[arg-type]
    assert (found.value, found.high) == (1.0, pytest.approx(1.0 + 1.96 * 0.5))
    assert found.described == (1.0 if named.startswith("parameter.") else None)
    finding = SimpleNamespace(effect=named, where=("all_wheels",), parameters={"torque": found})
    words = ", described as 1)." if named.startswith("parameter.") else " N m)."
    assert _sentence([finding]).endswith(words)  # type: ignore[list-item]
