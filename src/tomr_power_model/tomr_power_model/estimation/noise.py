"""What is left when everything imaginable has been fitted: the noise of each channel.

A channel's variance is  a + b (dP/dt)^2 + c P^2  with P what the model says: sensor noise, jitter
of stamps, and noise that grows with the quantity (an encoder's quanta pass through the driver into
the voltage). What is correlated counts for less: a sample weighs 1 / (variance T) with T the
autocorrelation time in samples.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.linalg.lapack import dpstrf
from scipy.optimize import nnls

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.estimation.linear_gaussian import AT_A_TIME, Gram, Matrix, product
from tomr_power_model.estimation.statistics import autocorrelation_time, robust_scale

Array = NDArray[np.float64]

_ROUNDS = 4
_RIDGE = 1e-2
_FLOOR = 0.3  # of the median deviation: a channel that stands still for long is not that exact
_OUTLIER = 4.0  # standard deviations: beyond, a sample weighs less
_EXACT = 1e-6  # of a quantity: no sensor knows it better
_LAGS = 80
_UNCORRELATED = 0.03


@frozen
class Noise:
    """Weights of all samples, and what they were made of."""

    weight: Array  # 1 / sigma of each sample, correlation and outliers accounted for, (n,)
    sigma: Array  # of each sample, (n,)
    time: tuple[float, ...]  # autocorrelation time of each channel [samples]


class Channel(Protocol):
    """What is known of a measured quantity."""

    @property
    def time(self) -> Array: ...  # s, (m,)

    @property
    def kind(self) -> str: ...  # "voltage", "speed", ...

    @property
    def quantum(self) -> float: ...  # in its unit


@frozen
class Local:
    """Columns that show in some rows only."""

    rows: NDArray[np.intp]  # (m,)
    matrix: Matrix  # (m, k)


def rows_of(channels: Sequence[Channel]) -> list[slice]:
    """Rows of each channel in the stacked values."""
    edges = np.cumsum([0, *(len(channel.time) for channel in channels)])
    return [slice(int(first), int(last)) for first, last in pairwise(edges)]


def noise_of(
    channels: Sequence[Channel],
    residual: Array,
    columns: Matrix,
    value: Array,
    *,
    time_derivative: Array,
    local: Sequence[Local] = (),
) -> Noise:
    """Noise left by a fit of all columns together.

    Args:
        channels: that the rows belong to.
        residual: measured - modelled, (n,).
        columns: of everything that may explain it, in prior standard deviations, (n, p).
        value: modelled, (n,).
        time_derivative: its derivative in time, (n,).
        local: further columns, of rows that do not overlap.
    """
    rows = rows_of(channels)
    variance = np.empty_like(residual)
    least = []
    for channel, part in zip(channels, rows, strict=True):
        least.append(_least(residual[part] + value[part], channel.quantum))
        variance[part] = _scale(residual[part], least[-1]) ** 2
    times = np.ones(len(rows))
    outlier = np.ones_like(residual)
    chosen = _distinct(columns, _weight(rows, variance, times, outlier))
    for _ in range(_ROUNDS):
        weight = _weight(rows, variance, times, outlier)
        left = _left(columns, chosen, residual, weight, local)
        for number, (channel, part) in enumerate(zip(channels, rows, strict=True)):
            noise = left[part]
            variance[part] = _variance(
                channel, noise, variance[part], value[part], time_derivative[part], least[number]
            )
            standard = noise / np.sqrt(variance[part])
            series = np.clip(standard, -_OUTLIER, _OUTLIER)
            lags = max(1, min(_LAGS, len(series) // 4))
            times[number] = autocorrelation_time([series], lags, _UNCORRELATED)
            outlier[part] = np.minimum(1.0, _OUTLIER / np.maximum(np.abs(standard), 1e-12))
    weight = _weight(rows, variance, times, outlier)
    return Noise(weight, np.sqrt(variance), tuple(times.tolist()))


def _weight(rows: Sequence[slice], variance: Array, times: Array, outlier: Array) -> Array:
    weight = outlier / np.sqrt(variance)
    for part, time in zip(rows, times, strict=True):
        weight[part] /= np.sqrt(time)
    return weight


def _distinct(columns: Matrix, weight: Array) -> NDArray[np.intp]:
    """Columns of which the others leave more than nothing (pivoted Cholesky)."""
    gram = Gram.of(columns, np.zeros_like(weight), weight)
    _, pivots, rank, _ = dpstrf(gram.matrix, tol=_RIDGE)
    return np.sort(pivots[:rank] - 1)


def _left(
    columns: Matrix,
    chosen: NDArray[np.intp],
    residual: Array,
    weight: Array,
    local: Sequence[Local],
) -> Array:
    """What a ridge regression on chosen columns and on local ones leaves.

    Local columns of different rows meet in the others only, so their blocks are eliminated:
    (A - sum C_w D_w^-1 C_w^T) x = a - sum C_w D_w^-1 d_w.
    """
    wanted, gram = residual * weight, Gram.of(columns, residual, weight, chosen)
    matrix, vector = gram.matrix + _RIDGE * np.eye(len(chosen)), gram.vector.copy()
    blocks = []
    for item in local:
        own = item.matrix * weight[item.rows, None]
        cross = _cross(columns, chosen, item.rows, own * weight[item.rows, None])
        inner = own.T @ own + _RIDGE * np.eye(own.shape[1])
        solved = np.linalg.solve(inner, np.column_stack([cross.T, own.T @ wanted[item.rows]]))
        matrix -= cross @ solved[:, :-1]
        vector -= cross @ solved[:, -1]
        blocks.append(solved)
    found = np.asarray(np.linalg.solve(matrix, vector), dtype=np.float64)
    everywhere = np.zeros(columns.shape[1])
    everywhere[chosen] = found
    left = residual - product(columns, everywhere)
    for item, solved in zip(local, blocks, strict=True):
        left[item.rows] -= item.matrix @ (solved[:, -1] - solved[:, :-1] @ found)
    return np.asarray(left)


def _cross(
    columns: Matrix, chosen: NDArray[np.intp], rows: NDArray[np.intp], other: Array
) -> Array:
    """Some columns of some rows, transposed, times (m, k); a part at a time, which needs little."""
    found = np.zeros((len(chosen), other.shape[1]))
    for first in range(0, len(rows), AT_A_TIME):
        part = slice(first, first + AT_A_TIME)
        found += columns[np.ix_(rows[part], chosen)].T @ other[part]
    return found


def _least(measured: Array, quantum: float) -> float:
    """Standard deviation that any channel has, also one that repeats a single value."""
    exact = _EXACT * math.sqrt(float(np.mean(measured**2)))
    return max(quantum / math.sqrt(12.0), exact, 1e-9)


def _scale(noise: Array, least: float) -> float:
    return max(robust_scale(noise), 0.1 * float(np.std(noise)), least)


def _variance(
    channel: Channel, noise: Array, before: Array, value: Array, change: Array, least: float
) -> Array:
    features = [np.ones_like(noise)]
    if channel.kind != "voltage":
        features += [change**2, value**2]
    matrix = np.stack(features, axis=1) / before[:, None]
    square = np.minimum(noise**2, _OUTLIER**2 * before) / before
    unit = np.sqrt((matrix**2).sum(axis=0)) + 1e-300
    shares, _ = nnls(matrix / unit, square)
    floor = max((_FLOOR * _scale(noise, least)) ** 2, least**2)
    if channel.kind in ("speed", "yaw"):
        floor += (SIMULATOR.motion * float(np.std(value))) ** 2
    return np.asarray(np.maximum((matrix * before[:, None]) @ (shares / unit), floor))
