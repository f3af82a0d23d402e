"""Findings that explain something, and whose size the recordings distinguish from nothing.

The evidence takes what is left for noise. Where a model lacks something, as of a wheel that sticks
and slips, a small finding brings much evidence by making up for that, here this way and there
that: leaving out parts of the recordings shows that its size is not known, not even its sign. And
one that only lets tolerances take better values explains none of the mismatch itself.
"""

import math

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.estimation.parameter import Parameter, neutral_of
from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import refine
from tomr_reality_gap.fit.uncertainty import own_sigma
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.rules import HALF_WIDTH

Array = NDArray[np.float64]

# Half-widths of its 95 % interval from nothing, three standard deviations: of the hundreds of
# hypotheses that are tried some are beyond theirs by chance.
_CLEAR = 3.0 / HALF_WIDTH


def significant(dataset: Dataset, found: Selection, tick: Tick = lambda done: None) -> Selection:
    """Findings but for those that explain nothing, and those not clearly beyond nothing."""
    while found.best.model.hypotheses:
        model = found.best.model
        explained = energies(dataset, found)
        worst = int(np.argmin(explained))
        if explained[worst] > 0.0:
            away = distances(model, own_sigma(dataset, found, linearise(dataset, model, ())))
            worst = int(np.argmin(away))
            if away[worst] > _CLEAR:
                break
        found = dropped(dataset, found, worst, tick)
    return found


def energies(dataset: Dataset, found: Selection) -> list[float]:
    """Squares, in units of noise, that leaving each finding out adds, all else as fitted."""
    model, weight = found.best.model, found.noise.weight
    fewer = [model.without(number) for number in range(len(model.hypotheses))]
    values = dataset.predict([item.described.robot for item in (model, *fewer)])
    left = [float((((dataset.value - value) * weight) ** 2).sum()) for value in values]
    return [item - left[0] for item in left[1:]]


def dropped(
    dataset: Dataset, found: Selection, number: int, tick: Tick = lambda done: None
) -> Selection:
    """A selection without one of its findings, all else fitted anew."""
    last, groups = found.rounds[-1], found.alternatives
    states = [(found.best.model.without(number), found.best.sensors)]
    (best,) = refine(dataset, states, last.jacobian, found.noise, tick=tick)
    return evolve(found, best=best, alternatives=(*groups[:number], *groups[number + 1 :]))


def distances(model: Model, sigma: Array) -> list[float]:
    """How far each hypothesis is from nothing [half-widths of its 95 % interval].

    Infinite where no size can be compared with nothing.

    Args:
        model: with its hypotheses.
        sigma: of their parameters, in their units, (p,).
    """
    nuisances = zip(model.nuisances, model.nuisance_offsets, strict=True)
    besides = {key: offset for parameter, offset in nuisances for key in parameter.keys}
    found, at = [], 0
    for hypothesis, offsets in zip(model.hypotheses, model.offsets, strict=True):
        widths = HALF_WIDTH * sigma[at : (at := at + len(offsets))]
        away = [
            abs(_beyond_nothing(model, hypothesis, item, besides) + offset) / max(width, 1e-300)
            for item, offset, width in zip(hypothesis.parameters, offsets, widths, strict=True)
            if not (item.is_shape or item.discrete_offset)
        ]
        found.append(max(away, default=math.inf))
    return found


def _beyond_nothing(
    model: Model, hypothesis: Hypothesis, parameter: Parameter, besides: dict[str, float]
) -> float:
    """By how much a parameter at no offset is beyond what counts as nothing: as described."""
    found = []
    for key in parameter.keys:
        nothing = float(model.base.values.get(key, neutral_of(key)))  # type: ignore[arg-type]
        start = hypothesis.start.get(key)
        found.append(besides.get(key, 0.0) if start is None else start - nothing)
    return sum(found) / len(found)
