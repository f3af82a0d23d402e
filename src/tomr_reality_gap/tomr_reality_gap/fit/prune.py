"""Second thoughts: whether each finding is still needed, and who else could take its place."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve

from tomr_reality_gap.fit.search import Fitted, Found, Tick, finding_cost, refine
from tomr_reality_gap.fit.study import Model, Study

_SECONDS = 4  # alternatives that are tried for each finding


def second_thoughts(study: Study, found: Found, tick: Tick = lambda done: None) -> Found:
    """Drop findings that later ones made needless, and try what each of them displaced."""
    best = found.best
    if len(best.model.hypotheses) < 2:
        tried = found.rounds[0].tried if best.model.hypotheses else ()
        return evolve(found, alternatives=(tuple(tried),) if tried else ())
    columns, noise = found.rounds[-1].columns, found.noise
    while len(best.model.hypotheses) > 1:
        fewer = [best.model.without(number) for number in range(len(best.model.hypotheses))]
        shorter = refine(study, fewer, columns, noise, tick)
        gains = [best.evidence - item.evidence for item in shorter]
        weakest = int(np.argmin(gains))
        if gains[weakest] > finding_cost(study):
            break
        best = shorter[weakest]
    groups: list[list[Fitted]] = []
    for number in range(len(best.model.hypotheses)):
        others = _alternatives(found, best.model, number)
        swapped = refine(study, others, columns, noise, tick)
        better = max(swapped, key=lambda item: item.evidence, default=best)
        groups.append([best, *swapped])
        if better.evidence > best.evidence:
            best = better
            groups[-1] = [best, *(item for item in groups[-1] if item is not best)]
    return evolve(found, best=best, alternatives=tuple(tuple(group) for group in groups))


def _alternatives(found: Found, model: Model, number: int) -> Sequence[Model]:
    """Models in which something else stands in for one finding."""
    place = model.hypotheses[number]
    names = {item.name for item in model.hypotheses}
    kept = model.without(number)
    candidates: dict[str, Model] = {}
    for step in found.rounds:
        for fitted in step.tried:
            other = fitted.model.hypotheses[-1]
            start = fitted.model.turns[-1]
            if other.name in names or other.name in candidates:
                continue
            if place.name not in {item.model.hypotheses[-1].name for item in step.tried}:
                continue
            joined = kept.joined(other)
            candidates[other.name] = evolve(joined, turns=(*joined.turns[:-1], start))
    return list(candidates.values())[:_SECONDS]
