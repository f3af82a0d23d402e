"""Backward elimination: whether each finding is still needed, and what could take its place."""

from collections.abc import Iterator, Sequence
from itertools import chain, combinations

import numpy as np
from attrs import evolve, frozen

from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection, finding_cost
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel, refine
from tomr_reality_gap.fit.rivals import Responses
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

_STAND_INS = 4  # alternatives that are tried for each finding
_MERGERS = 2  # that are tried for each pair of them
_SWAPS = 3  # at most


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
        price = Price.of(dataset, found, best)
        gains = [price.worth(best) - price.worth(item) for item in shorter]
        weakest = int(np.argmin(gains))
        if gains[weakest] > 0.0:
            break
        best = shorter[weakest]
    responses = Responses(dataset, found, candidates)
    groups = _alternatives(responses, best, tick)
    for _ in range(_SWAPS):
        price = Price.of(dataset, found, best)
        better = max((*chain(*groups), *_merged(responses, best, tick)), key=price.worth)
        if price.worth(better) <= price.worth(best):
            break
        best = better
        groups = _alternatives(responses, best, tick)
    return evolve(found, best=best, alternatives=tuple(groups))


@frozen
class Price:
    """Log evidence that effects must bring."""

    usual: float  # a finding
    least: float  # the second of friction's parts at one place, which are one finding

    @classmethod
    def of(cls, dataset: Dataset, found: Selection, best: FittedModel) -> "Price":
        samples = len(dataset.value)
        return cls(found.cost(samples, best), finding_cost(samples))

    def worth(self, item: FittedModel) -> float:
        """Log evidence less what so many effects must bring."""
        seconds = len(item.model.hypotheses) - item.model.findings
        return item.evidence - self.usual * item.model.weight + (self.usual - self.least) * seconds


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


def _merged(responses: Responses, best: FittedModel, tick: Tick) -> list[FittedModel]:
    """Models in which one thing does the work of two findings: what came first may have been as
    good a name for half of it, and another for the rest; or it has another shape, which the
    second only made up for.
    """
    found, count = responses.found, len(best.model.hypotheses)
    pairs = list(combinations(range(count), 2)) if responses.candidates else []
    trials = [model for pair in pairs for model in responses.nearest(best, *pair)[:_MERGERS]]
    both_ways = [way for first, second in pairs for way in ((first, second), (second, first))]
    trials += [model for way in both_ways for model in _reshaped(responses, best.model, *way)]
    states = [(model, best.sensors) for model in trials]
    return refine(responses.dataset, states, found.rounds[-1].jacobian, found.noise, tick=tick)


def _reshaped(responses: Responses, model: Model, number: int, needless: int) -> Iterator[Model]:
    """Models in which one finding has another shape, as large as it is, and another is gone."""
    kept = [at != needless for at in range(len(model.hypotheses))]
    known, size = model.hypotheses[number], model.offsets[number][0]
    for item in responses.candidates:
        if item.name == known.name and item.key != known.key:
            offsets = (size, *(0.0,) * (len(item.parameters) - 1))
            yield model.swapped(number, item, offsets).kept(kept)


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
    return [*{**tried, **calculated}.values(), *_together(responses, model, number)]


def _together(responses: Responses, model: Model, number: int) -> Iterator[Model]:
    """Models with the effects whose work another does alone, in its place or in that of one of
    them; or with that other in the place of them all.

    Coulomb friction alone is too large where viscous friction is left out too.
    """
    where, known = model.hypotheses[number].where, model.hypotheses[number].name
    here = {item.effect: item for item in responses.candidates if item.where == where}
    sizes = _sizes_tried(responses.found)
    for whole in here.values():
        parts = {here[effect].name: here[effect] for effect in whole.stands_for if effect in here}
        if len(parts) < 2 or known not in (whole.name, *parts):
            continue
        given = [whole] if parts.keys() <= model.names else parts.values()
        yield model.exchanged({whole.name, *parts}, given, sizes)


def _sizes_tried(found: Selection) -> dict[str, tuple[float, ...]]:
    """Offsets at which each hypothesis was tried first, by its name."""
    return {
        known.name: offsets
        for step in reversed(found.rounds)
        for item in reversed(step.tried)
        for known, offsets in zip(item.model.hypotheses, item.model.offsets, strict=True)
    }
