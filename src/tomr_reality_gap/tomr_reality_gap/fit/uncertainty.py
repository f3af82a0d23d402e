"""How well the values of findings are known: by how leaving out blocks of the data moves them.

Whatever the model lacks is no noise: it is wrong for a whole straight, or a whole drive. What each
block of the recordings pulls the values towards shows how wrong they may be for it.
"""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period
from tomr_power_model.estimation.intervals import (
    block_length,
    interval_factor,
    jackknife_covariance,
)
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import prior_stds
from tomr_power_model.estimation.statistics import autocorrelation_time
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import Jacobian
from tomr_reality_gap.rules import HALF_WIDTH

Array = NDArray[np.float64]


def own_sigma(dataset: Dataset, found: Selection, jacobian: Jacobian) -> Array:
    """Of the parameters of the best model's hypotheses, in their units, (p,).

    At least what the noise makes of them; 1.96 times it is half of the 95 % interval.
    """
    best, weight = found.best, found.noise.weight
    residual = (dataset.value - best.value) * weight
    block = blocks_of(dataset, residual)
    scores, informed = [], []
    for number in range(int(block.max()) + 1):
        rows = block == number
        columns = jacobian.matrix[rows] * weight[rows, None]
        scores.append(columns.T @ residual[rows])
        informed.append(columns.T @ columns)
    deviation = np.sqrt(np.diag(jackknife_covariance(np.stack(scores), np.stack(informed))))
    deviation *= interval_factor(len(scores)) / HALF_WIDTH
    own = best.model.own
    return np.maximum(best.own_sigma, deviation[len(deviation) - len(own) :] * prior_stds(own))


def blocks_of(dataset: Dataset, residual: Array) -> NDArray[np.intp]:
    """Number of the block of each row, (n,)."""
    channels, parts = dataset.channels, rows_of(dataset.channels)
    ends = [max(float(c.time[-1]) for c in item.channels) for item in dataset.simulations]
    times = [
        autocorrelation_time([residual[part]]) * median_period(channel.time)
        for channel, part in zip(channels, parts, strict=True)
    ]
    length = block_length(ends, max(times))
    found, first = [], 0
    for item, end in zip(dataset.simulations, ends, strict=True):
        count = max(1, round(end / length))
        for channel in item.channels:
            share = np.clip(channel.time / end, 0.0, 1.0)
            found.append(first + np.minimum((share * count).astype(np.intp), count - 1))
        first += count
    return np.concatenate(found)
