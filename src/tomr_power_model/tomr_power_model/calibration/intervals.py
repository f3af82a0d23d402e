"""How well a fit's values are known: sandwich of blocks, and what the data leave open.

Residuals of a power model are correlated over tenths of seconds to seconds: a wrong friction is
wrong for a whole straight. The scores J^T psi are therefore summed over blocks longer than that,
and the covariance is that of the jackknife over blocks (CR3 of the cluster-robust family):

    delta_b = (H - H_b)^-1 g_b,  cov = (B - 1) / B sum_b delta_b delta_b^T + H^-1 L H^-1

with the information H = sum_b H_b + L of data and beliefs L, all in units of the beliefs' spread.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.stats import t as student

from tomr_power_model.calibration.loss import influence
from tomr_power_model.calibration.problem import Problem
from tomr_power_model.calibration.samples import CHANNELS, Samples
from tomr_power_model.estimation.statistics import autocorrelation_time

Array = NDArray[np.float64]

_SHORTEST_BLOCK = 1.0  # s
_TIMES_PER_BLOCK = 8.0  # correlation times in a block
_FEWEST_BLOCKS = 12
_MANY_RECORDINGS = 20
_LEVEL = 0.95


@frozen
class Spread:
    """Uncertainty of the fitted values, in units of the beliefs' spread."""

    deviation: Array  # standard deviation, (p,)
    factor: float  # times it is half of the 95 % interval
    correlation: Array  # as data and beliefs together leave it, (p, p)
    learned: Array  # posterior over prior standard deviation: 1 if the data say nothing, (p,)
    blocks: int
    block_length: float  # s


def spread_of(
    problem: Problem, standard: Array, slope: Array, weight: Array, robust: bool
) -> Spread:
    """Uncertainty at the optimum.

    Args:
        problem: what was fitted.
        standard: residuals over their scale, (n, 4), NaN where nothing was measured.
        slope: derivative of the modelled power over scale by value over belief, (n, 4, p).
        weight: of each channel, (4,).
        robust: whether the loss is bent.
    """
    psi, curvature = influence(standard, robust)
    known = np.isfinite(standard)
    heavy = np.where(known, np.square(weight), 0.0)
    push = np.where(known, psi, 0.0) * heavy
    slope = np.where(known[:, :, None], slope, 0.0)
    pull = np.where(known, curvature, 0.0) * heavy
    length = block_length(problem.samples, psi)
    block = blocks(problem.samples, length)
    number = int(block[-1]) + 1
    values = slope.shape[-1]
    scores = np.zeros((number, values))
    np.add.at(scores, block, np.einsum("nc,ncp->np", push, slope))
    informed = np.zeros((number, values, values))
    for index in range(number):
        rows = block == index
        informed[index] = np.einsum("ncp,nc,ncq->pq", slope[rows], pull[rows], slope[rows])
    return _sandwich(scores, informed, length)


def _sandwich(scores: Array, informed: Array, length: float) -> Spread:
    number, values = scores.shape
    belief = np.eye(values)
    information = informed.sum(axis=0) + belief
    moved = np.linalg.solve(information - informed, scores[:, :, None])[:, :, 0]
    bread = np.linalg.inv(information)
    covariance = (number - 1) / number * moved.T @ moved + bread @ belief @ bread
    naive = np.sqrt(np.diag(bread))
    deviation = np.sqrt(np.diag(covariance))
    return Spread(
        deviation=deviation,
        factor=float(student.ppf(0.5 + _LEVEL / 2.0, max(number - 1, 1))),
        correlation=bread / np.outer(naive, naive),
        learned=np.minimum(np.maximum(naive, deviation), 1.0),
        blocks=number,
        block_length=length,
    )


def block_length(samples: tuple[Samples, ...], psi: Array) -> float:
    """Length of the blocks [s]: several correlation times, but leaving enough blocks.

    Of many recordings each is a block: what a model misses at one heading lasts a whole drive, and
    is lost among the noise where correlation is measured within drives.
    """
    durations = [float(item.time[-1] - item.time[0]) for item in samples]
    if len(durations) >= _MANY_RECORDINGS:
        return max(durations)
    period = float(np.median(np.concatenate([np.diff(item.time) for item in samples])))
    times = [
        autocorrelation_time(pieces_of(samples, psi[:, channel]))
        for channel in range(CHANNELS)
        if np.isfinite(psi[:, channel]).any()
    ]
    total = sum(len(item.time) for item in samples) * period
    wanted = max(_SHORTEST_BLOCK, _TIMES_PER_BLOCK * max(times) * period)
    return min(wanted, max(_SHORTEST_BLOCK, total / _FEWEST_BLOCKS))


def blocks(samples: tuple[Samples, ...], length: float) -> NDArray[np.int64]:
    """Number of the block of each instant; a block ends with its stretch."""
    numbers, count = [], 0
    for item in samples:
        for stretch in np.unique(item.stretch):
            time = item.time[item.stretch == stretch]
            pieces = max(1, round((time[-1] - time[0]) / length))
            share = (time - time[0]) / max(time[-1] - time[0], 1e-9)
            numbers.append(count + np.minimum((share * pieces).astype(np.int64), pieces - 1))
            count += pieces
    return np.concatenate(numbers)


def pieces_of(samples: tuple[Samples, ...], series: Array) -> list[Array]:
    """A series of all samples, cut into uninterrupted stretches."""
    pieces, start = [], 0
    for item in samples:
        values = series[start : start + len(item.time)]
        start += len(item.time)
        pieces += [values[item.stretch == stretch] for stretch in np.unique(item.stretch)]
    return pieces
