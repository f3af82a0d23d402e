"""Models brought to their best: what a payload shares with the mass stays the payload's."""

import pytest
from attrs import evolve

from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.refine import FittedModel, refine, refined_at_itself

from .test_alignment import simulation  # noqa: F401 -- the fixture
from .test_forward_selection import searched

TRIED = ("body.payload",)


def _mass(fitted: FittedModel) -> float:
    """How far the mass is off, as a nuisance [prior standard deviations]."""
    pairs = zip(fitted.model.nuisances, fitted.model.nuisance_offsets, strict=True)
    (offset,) = (size / item.prior_std for item, size in pairs if item.keys == ("robot.mass",))
    return float(offset)


def _no_tick(done: int) -> None:
    """Nobody watches."""


def test_a_large_payload_leaves_next_to_nothing_to_the_mass(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Both do the same. The likeliest shares, m and p, are as the squares of their prior
    deviations: m / p = 0.1732^2 / 3^2, so that of 9 kg the mass has 0.17 of its deviation.
    """
    robot = simulation.robot
    real = evolve(robot, mass=1.6 * robot.mass)
    dataset, found = searched(simulation, simulation.predict([real])[0], TRIED)
    described = linearise(dataset, found.without.model, ())
    begun = found.without.model.joined(found.best.model.hypotheses[0])
    states = [(begun, found.best.sensors)]
    (bent,) = refine(dataset, states, described, found.noise, tick=_no_tick)
    fitted = refined_at_itself(dataset, bent, found.noise, tick=_no_tick)
    (((payload,),), sigma) = fitted.model.offsets, fitted.own_sigma[0]
    assert payload == pytest.approx(0.6 * robot.mass, abs=4.0 * sigma)
    assert _mass(bent) > 0.5
    assert _mass(fitted) == pytest.approx(0.17, abs=0.03)
    assert fitted.evidence == bent.evidence
    again = refined_at_itself(dataset, fitted, found.noise, tick=_no_tick)
    assert again.model.offsets[0] == pytest.approx((payload,), abs=0.05 * sigma)


def test_a_model_without_findings_is_as_it_was(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    dataset, found = searched(simulation, simulation.predict([simulation.robot])[0], TRIED)
    assert not found.best.model.hypotheses
    assert refined_at_itself(dataset, found.best, found.noise, tick=_no_tick) is found.best
