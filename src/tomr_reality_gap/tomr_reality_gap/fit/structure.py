"""How far values may be off for what the recordings show and no finding names.

A finding has to bring a part of the evidence, and a simulator is exact to a part of a value only:
what is smaller stays without a name, however plainly it shows. The values of the findings make up
for it, and a set of recordings in which it is named gives others. So each hypothesis that is not
named is added to the best model by itself, linearised, with a size of either sign, for whatever it
is that shows like this; how far those that the recordings want move a value is what that value may
be off by.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import AT_A_TIME, Gram, Matrix, solve
from tomr_power_model.estimation.parameter import bounds, prior_stds
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import Jacobian
from tomr_reality_gap.fit.refine import units_of
from tomr_reality_gap.fit.screening import exclude_each_other
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

Array = NDArray[np.float64]

_WANTED = 20.0  # log evidence, linearised: a name costs as much or more
_AT_EDGE = 1e-6  # of a bound


@frozen
class Addition:
    """A hypothesis that no finding names, added to the best model by itself."""

    hypothesis: Hypothesis
    gain: float  # log evidence
    shift: Array  # of each parameter of the findings, in its unit, (p,)


def structural_shifts(additions: Sequence[Addition], offsets: Array) -> Array:
    """How far each value of the findings may be off for what is not named, in its unit, (p,).

    What would take a value away altogether is no correction of it but a rival of its finding.

    Args:
        additions: of the best model.
        offsets: of the values from the description, in their units, (p,).
    """
    found = np.zeros(len(offsets))
    for item in additions:
        if item.gain > _WANTED and (np.abs(item.shift) < np.abs(offsets)).all():
            found = np.maximum(found, np.abs(item.shift))
    return found


def additions_of(
    dataset: Dataset, found: Selection, jacobian: Jacobian, candidates: Sequence[Hypothesis]
) -> Iterator[Addition]:
    """Each candidate that the best model lacks, beside all that it has.

    Args:
        dataset: the recordings.
        found: the selection; its last round holds the derivatives by the candidates.
        jacobian: of the best model.
        candidates: what could have been named.
    """
    best, last = found.best, found.rounds[-1].jacobian
    model = best.model
    free = _free(jacobian)
    columns = [jacobian.matrix[:, free], last.matrix[:, last.kept :]]
    units = units_of(model, best.sensors)[free]
    gram = _gram(columns, dataset.value - best.value, units, found.noise.weight)
    base, own = list(range(len(free))), slice(len(free) - len(model.own), len(free))
    std = prior_stds(model.own)
    before = solve(gram, base)
    for item in candidates:
        first = item.parameters[0]
        if item.name in model.names or item.key not in last.candidates or first.discrete_offset:
            continue
        if any(exclude_each_other(item, other) for other in model.hypotheses):
            continue
        part, at = last.candidates[item.key], len(free) - last.kept
        rows = [k + at for k in range(part.start, part.stop) if gram.matrix[k + at, k + at] > 0.0]
        if not rows:
            continue
        after = solve(gram, [*base, *rows])
        gain = after.evidence - before.evidence + item.log_prior
        yield Addition(item, gain, (after.mean[own] - before.mean[own]) * std)


def _free(jacobian: Jacobian) -> list[int]:
    """Columns of the best model but for nuisances that are held at the edge of their tolerance."""
    model = jacobian.model
    low, high = bounds(model.nuisances)
    offsets = np.array(model.nuisance_offsets)
    inside = (offsets > low * (1.0 - _AT_EDGE)) & (offsets < high * (1.0 - _AT_EDGE))
    return [*np.flatnonzero(inside).tolist(), *range(jacobian.sensors.start, jacobian.kept)]


def _gram(columns: Sequence[Matrix], residual: Array, units: Array, weight: Array) -> Gram:
    """Normal equations of columns that lie in several arrays, as if nothing were offset yet:
    priors are about whole offsets. `units`: of the first array's columns."""
    count = sum(part.shape[1] for part in columns)
    matrix, vector, square = np.zeros((count, count)), np.zeros(count), 0.0
    for first in range(0, len(residual), AT_A_TIME):
        rows = slice(first, first + AT_A_TIME)
        part = np.concatenate([item[rows] for item in columns], axis=1) * weight[rows, None]
        whole = residual[rows] * weight[rows] + part[:, : len(units)] @ units
        matrix += part.T @ part
        vector += part.T @ whole
        square += float(whole @ whole)
    return Gram(matrix, vector, square)
