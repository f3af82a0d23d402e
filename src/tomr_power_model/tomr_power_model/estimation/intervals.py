"""How well estimates are known: sandwich of blocks, and what the data leave open.

Residuals of a model are correlated over tenths of seconds to seconds: a wrong friction is
wrong for a whole straight. The scores J^T psi are therefore summed over blocks longer than that,
and the covariance is that of the jackknife over blocks (CR3 of the cluster-robust family):

    delta_b = (H - H_b)^-1 g_b,  cov = (B - 1) / B sum_b delta_b delta_b^T + H^-1 L H^-1

with the information H = sum_b H_b + L of data and priors L, all in units of the prior standard
deviations.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.special import stdtrit

from tomr_power_model.estimation.robust import influence
from tomr_power_model.estimation.statistics import autocorrelation_time

Array = NDArray[np.float64]

_SHORTEST_BLOCK = 1.0  # s
_TIMES_PER_BLOCK = 8.0  # correlation times in a block
_FEWEST_BLOCKS = 12
_MANY_RECORDINGS = 8
_LEVEL = 0.95


class Sampled(Protocol):
    """When a recording was sampled."""

    @property
    def time(self) -> Array: ...  # s, (n,)

    @property
    def stretch(self) -> NDArray[np.int64]: ...  # number of the uninterrupted stretch, (n,)


@frozen
class Uncertainty:
    """Of estimates, in units of their prior standard deviations."""

    deviation: Array  # standard deviation, (p,)
    factor: float  # times it is half of the 95 % interval
    correlation: Array  # as data and priors together leave it, (p, p)
    shrinkage: Array  # posterior over prior deviation: 1 if the data say nothing, (p,)
    blocks: int
    block_length: float  # s


def block_jackknife(
    recordings: Sequence[Sampled], standard: Array, slope: Array, weight: Array, *, robust: bool
) -> Uncertainty:
    """Uncertainty at the optimum.

    Args:
        recordings: that the rows belong to, one after another.
        standard: residuals over their scale, (n, c), NaN where nothing was measured.
        slope: derivative of the prediction over scale by parameter over prior_std, (n, c, p).
        weight: of each channel, (c,).
        robust: whether the loss is soft L1.
    """
    psi, curvature = influence(standard, robust)
    known = np.isfinite(standard)
    heavy = np.where(known, np.square(weight), 0.0)
    push = np.where(known, psi, 0.0) * heavy
    slope = np.where(known[:, :, None], slope, 0.0)
    pull = np.where(known, curvature, 0.0) * heavy
    durations = [float(item.time[-1] - item.time[0]) for item in recordings]
    length = block_length(durations, _correlation_time(recordings, psi))
    block = blocks(recordings, length)
    number = int(block[-1]) + 1
    values = slope.shape[-1]
    scores = np.zeros((number, values))
    np.add.at(scores, block, np.einsum("nc,ncp->np", push, slope))
    informed = np.zeros((number, values, values))
    for index in range(number):
        rows = block == index
        informed[index] = np.einsum("ncp,nc,ncq->pq", slope[rows], pull[rows], slope[rows])
    return _sandwich(scores, informed, length)


def _sandwich(scores: Array, informed: Array, length: float) -> Uncertainty:
    bread = np.linalg.inv(informed.sum(axis=0) + np.eye(scores.shape[1]))
    naive = np.sqrt(np.diag(bread))
    deviation = np.sqrt(np.diag(jackknife_covariance(scores, informed)))
    return Uncertainty(
        deviation=deviation,
        factor=interval_factor(len(scores)),
        correlation=bread / np.outer(naive, naive),
        shrinkage=np.minimum(np.maximum(naive, deviation), 1.0),
        blocks=len(scores),
        block_length=length,
    )


def jackknife_covariance(scores: Array, informed: Array) -> Array:
    """Of unknowns in prior standard deviations, (p, p).

    Args:
        scores: of each block's data at the optimum, (b, p).
        informed: information of each block's data, (b, p, p).
    """
    number, values = scores.shape
    information = informed.sum(axis=0) + np.eye(values)
    moved = np.linalg.solve(information - informed, scores[:, :, None])[:, :, 0]
    bread = np.linalg.inv(information)
    return np.asarray((number - 1) / number * moved.T @ moved + bread @ bread)


def interval_factor(blocks: int) -> float:
    """Times the standard deviation that many blocks estimate is half of the 95 % interval."""
    return float(stdtrit(max(blocks - 1, 1), 0.5 + _LEVEL / 2.0))


def block_length(durations: Sequence[float], correlation_time: float) -> float:
    """Length of the blocks [s]: several correlation times, but leaving enough blocks.

    Of many recordings each is a block: what a model misses at one heading lasts a whole drive, and
    is lost among the noise where correlation is measured within drives.

    Args:
        durations: of the recordings [s].
        correlation_time: of the residuals [s].
    """
    if len(durations) >= _MANY_RECORDINGS:
        return max(durations)
    wanted = max(_SHORTEST_BLOCK, _TIMES_PER_BLOCK * correlation_time)
    return min(wanted, max(_SHORTEST_BLOCK, sum(durations) / _FEWEST_BLOCKS))


def _correlation_time(recordings: Sequence[Sampled], psi: Array) -> float:
    """Longest of the channels' [s]."""
    period = float(np.median(np.concatenate([np.diff(item.time) for item in recordings])))
    times = [
        autocorrelation_time(uninterrupted(recordings, series))
        for series in psi.T
        if np.isfinite(series).any()
    ]
    return max(times) * period


def blocks(recordings: Sequence[Sampled], length: float) -> NDArray[np.int64]:
    """Number of the block of each instant; a block ends with its stretch."""
    numbers, count = [], 0
    times = np.concatenate([item.time for item in recordings])
    for time in uninterrupted(recordings, times):
        pieces = max(1, round((time[-1] - time[0]) / length))
        share = (time - time[0]) / max(time[-1] - time[0], 1e-9)
        numbers.append(count + np.minimum((share * pieces).astype(np.int64), pieces - 1))
        count += pieces
    return np.concatenate(numbers)


def uninterrupted(recordings: Sequence[Sampled], series: Array) -> list[Array]:
    """A series of all recordings' instants, cut into uninterrupted stretches."""
    pieces, start = [], 0
    for item in recordings:
        values = series[start : (start := start + len(item.time))]
        pieces += [values[item.stretch == stretch] for stretch in np.unique(item.stretch)]
    return pieces
