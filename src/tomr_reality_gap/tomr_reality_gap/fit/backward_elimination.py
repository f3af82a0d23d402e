"""Backward elimination: whether each finding is still needed, and what could take its place."""

import numpy as np
from attrs import evolve

from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection, finding_cost
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel, refine

_STAND_INS = 4  # alternatives that are tried for each finding
_SWAPS = 3  # at most


def backward_elimination(
    dataset: Dataset, found: Selection, tick: Tick = lambda done: None
) -> Selection:
    """Drop findings that later ones made needless, and try what each of them displaced."""
    best = found.best
    if len(best.model.hypotheses) < 2:
        tried = found.rounds[0].tried if best.model.hypotheses else ()
        return evolve(found, alternatives=(tuple(tried),) if tried else ())
    jacobian, noise = found.rounds[-1].jacobian, found.noise
    while len(best.model.hypotheses) > 1:
        count = len(best.model.hypotheses)
        fewer = [(best.model.without(number), best.sensors) for number in range(count)]
        shorter = refine(dataset, fewer, jacobian, noise, tick=tick)
        gains = [best.evidence - item.evidence for item in shorter]
        weakest = int(np.argmin(gains))
        if gains[weakest] > finding_cost(
            len(dataset.value), best.evidence - found.without.evidence
        ):
            break
        best = shorter[weakest]
    groups = _alternatives(dataset, found, best, tick)
    for _ in range(_SWAPS):
        better = max((item for group in groups for item in group), key=lambda item: item.evidence)
        if better.evidence <= best.evidence:
            break
        best = better
        groups = _alternatives(dataset, found, best, tick)
    return evolve(found, best=best, alternatives=tuple(groups))


def _alternatives(
    dataset: Dataset, found: Selection, best: FittedModel, tick: Tick
) -> list[tuple[FittedModel, ...]]:
    """For each finding the model as it is, then with something else in the finding's place."""
    jacobian, noise = found.rounds[-1].jacobian, found.noise
    trials = [_stand_ins(found, best.model, at) for at in range(len(best.model.hypotheses))]
    states = [(model, best.sensors) for group in trials for model in group]
    fitted = iter(refine(dataset, states, jacobian, noise, tick=tick))
    return [(best, *(next(fitted) for _ in group)) for group in trials]


def _stand_ins(found: Selection, model: Model, number: int) -> list[Model]:
    """Models in which something else that was tried stands in for one finding."""
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
    return list(candidates.values())[:_STAND_INS]
