"""Second thoughts: whether each finding is still needed, and who else could take its place."""

import numpy as np
from attrs import evolve

from tomr_reality_gap.fit.refine import Fitted, Tick, refine
from tomr_reality_gap.fit.search import Found, finding_cost
from tomr_reality_gap.fit.study import Model, Study

_SECONDS = 4  # alternatives that are tried for each finding
_SWAPS = 3  # at most


def second_thoughts(study: Study, found: Found, tick: Tick = lambda done: None) -> Found:
    """Drop findings that later ones made needless, and try what each of them displaced."""
    best = found.best
    if len(best.model.hypotheses) < 2:
        tried = found.rounds[0].tried if best.model.hypotheses else ()
        return evolve(found, alternatives=(tuple(tried),) if tried else ())
    columns, noise = found.rounds[-1].columns, found.noise
    while len(best.model.hypotheses) > 1:
        count = len(best.model.hypotheses)
        fewer = [(best.model.without(number), best.timing) for number in range(count)]
        shorter = refine(study, fewer, columns, noise, tick)
        gains = [best.evidence - item.evidence for item in shorter]
        weakest = int(np.argmin(gains))
        if gains[weakest] > finding_cost(study, best.evidence - found.without.evidence):
            break
        best = shorter[weakest]
    groups = _alternatives(study, found, best, tick)
    for _ in range(_SWAPS):
        better = max((item for group in groups for item in group), key=lambda item: item.evidence)
        if better.evidence <= best.evidence:
            break
        best = better
        groups = _alternatives(study, found, best, tick)
    return evolve(found, best=best, alternatives=tuple(groups))


def _alternatives(study: Study, found: Found, best: Fitted, tick: Tick) -> list[tuple[Fitted, ...]]:
    """For each finding the model as it is, then with something else in the finding's place."""
    columns, noise = found.rounds[-1].columns, found.noise
    trials = [_stand_ins(found, best.model, at) for at in range(len(best.model.hypotheses))]
    states = [(model, best.timing) for group in trials for model in group]
    fitted = iter(refine(study, states, columns, noise, tick))
    return [(best, *(next(fitted) for _ in group)) for group in trials]


def _stand_ins(found: Found, model: Model, number: int) -> list[Model]:
    """Models in which something else that was tried stands in for one finding."""
    place = model.hypotheses[number].name
    candidates: dict[str, Model] = {}
    for step in found.rounds:
        at = len(step.columns.model.hypotheses)
        others = [(item.model.hypotheses[at], item.model.turns[at]) for item in step.tried]
        if place not in {other.name for other, _ in others}:
            continue
        for other, turns in others:
            if other.name not in model.names and other.name not in candidates:
                candidates[other.name] = model.swapped(number, other, turns)
    return list(candidates.values())[:_SECONDS]
