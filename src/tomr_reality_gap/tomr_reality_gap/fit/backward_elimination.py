"""Backward elimination: whether each finding is still needed, and what could take its place."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve

from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection, finding_cost
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel, refine
from tomr_reality_gap.fit.rivals import Responses
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

_STAND_INS = 4  # alternatives that are tried for each finding
_SWAPS = 3  # at most
_FRICTION = ("friction.coulomb", "friction.viscous")


def backward_elimination(
    dataset: Dataset,
    found: Selection,
    candidates: Sequence[Hypothesis] = (),
    tick: Tick = lambda done: None,
) -> Selection:
    """Drop findings that later ones made needless, and try what could stand in for each of them:
    what it displaced, and whatever of the candidates would show nearly the same.
    """
    best = found.best
    if not best.model.hypotheses:
        return found
    jacobian, noise = found.rounds[-1].jacobian, found.noise
    while len(best.model.hypotheses) > 1:
        count = len(best.model.hypotheses)
        fewer = [(best.model.without(number), best.sensors) for number in range(count)]
        shorter = refine(dataset, fewer, jacobian, noise, tick=tick)
        gains = [
            _worth(best, cost) - _worth(item, cost)
            for item, cost in zip(shorter, _costs(dataset, found, best), strict=True)
        ]
        weakest = int(np.argmin(gains))
        if gains[weakest] > 0.0:
            break
        best = shorter[weakest]
    responses = Responses(dataset, found, candidates)
    groups = _alternatives(responses, best, tick)
    for _ in range(_SWAPS):
        cost = found.cost(len(dataset.value), best)
        better = max((item for group in groups for item in group), key=lambda m: _worth(m, cost))
        if _worth(better, cost) <= _worth(best, cost):
            break
        best = better
        groups = _alternatives(responses, best, tick)
    return evolve(found, best=best, alternatives=tuple(groups))


def _costs(dataset: Dataset, found: Selection, best: FittedModel) -> list[float]:
    """What each finding must bring; friction's two parts at one place count as one finding."""
    usual, least = found.cost(len(dataset.value), best), finding_cost(len(dataset.value))
    parts = [item for item in best.model.hypotheses if item.effect in _FRICTION]
    return [
        least
        if any(one is not item and one.where == item.where for one in parts)
        and item.effect in _FRICTION
        else usual
        for item in best.model.hypotheses
    ]


def _worth(item: FittedModel, cost: float) -> float:
    """Log evidence less what so many effects must bring."""
    return item.evidence - cost * item.model.weight


def _alternatives(
    responses: Responses, best: FittedModel, tick: Tick
) -> list[tuple[FittedModel, ...]]:
    """For each finding the model as it is, then with something else in the finding's place."""
    found = responses.found
    trials = [_stand_ins(responses, best, at) for at in range(len(best.model.hypotheses))]
    states = [(model, best.sensors) for group in trials for model in group]
    jacobian = found.rounds[-1].jacobian
    fitted = iter(refine(responses.dataset, states, jacobian, found.noise, tick=tick))
    return [(best, *(next(fitted) for _ in group)) for group in trials]


def _stand_ins(responses: Responses, best: FittedModel, number: int) -> list[Model]:
    """Models in which something else stands in for one finding: what was tried in its place, and
    what shows the same.
    """
    model, found = best.model, responses.found
    place = model.hypotheses[number].name
    candidates: dict[str, Model] = {}
    for step in found.rounds:
        at = len(step.jacobian.model.hypotheses)
        others = [(item.model.hypotheses[at], item.model.offsets[at]) for item in step.tried]
        if place not in {other.name for other, _ in others}:
            continue
        for other, offsets in others:
            if other.name not in model.names and other.name not in candidates:
                candidates[other.name] = model.swapped(number, other, offsets)
    nearest = responses.nearest(best, number) if responses.candidates else []
    # What was worked out beside the other findings is the better start.
    calculated = {item.hypotheses[number].name: item for item in nearest[:_STAND_INS]}
    tried = dict(list(candidates.items())[:_STAND_INS])
    return list({**tried, **calculated}.values())
