"""What a model leaves of recordings, and how much of it columns predict of what they never saw."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, Matrix, product, solve
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import autocorrelation_time, robust_scale
from tomr_reality_gap.fit.dataset import Dataset

Array = NDArray[np.float64]

_LAGS, _NEGLIGIBLE = 80, 0.03  # of an autocorrelation
_STRETCHES = 8  # of a recording, each left out once
_MOMENT = 0.25  # s: of every four one is left out
_MOMENTS = 4
_INEXACT = 0.01  # of a channel's standard deviation, besides its noise
_SHOWS = 1.0  # eigenvalue of a nuisance's information beyond which it is fitted
_SURELY = 3.0  # standard deviations of a sum of squares of noise
_SIZES = tuple(10.0**-power for power in (0.0, 0.5, 1.0, 1.5, 2.0))  # of a prior, that are tried


@frozen
class Remainder:
    """What a model leaves of the recordings, and what it could still make of it."""

    dataset: Dataset
    residual: Array  # whitened by what differs from sample to sample, (n,)
    base: Array  # derivatives by what is not exactly known, likewise, (n, q)
    weight: Array  # (n,)

    @classmethod
    def of(
        cls, dataset: Dataset, value: Array, columns: Array, change: Array | None = None
    ) -> "Remainder":
        """Of simulated values.

        Args:
            dataset: recordings.
            value: simulated, (n,).
            columns: derivatives in prior standard deviations, (n, p).
            change: what a term is known to add: what varies with it is no noise, (n,).
        """
        residual = dataset.value - value
        noise = residual if change is None else residual - change
        weight = np.empty_like(residual)
        for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True):
            rounding = channel.rounding(value[part])
            weight[part] = 1.0 / _scatter(channel.value, noise[part], rounding)
        gram = Gram.of(columns, residual, weight)
        values, vectors = np.linalg.eigh(gram.matrix)
        shown = (columns @ vectors[:, values > _SHOWS]) * weight[:, None]
        return cls(dataset, residual * weight, np.asarray(shown, dtype=np.float64), weight)

    def beside(self, columns: Sequence[Matrix]) -> Matrix:
        """Whitened columns beside the base, (n, q + p)."""
        return np.concatenate([self.base.astype(np.float32), *columns], axis=1)

    def left(self, change: Array) -> Array:
        """What is left beside a change of all values, what is not exactly known fitted, (n,)."""
        return self.beyond_base(self.residual - change * self.weight)

    def beyond_base(self, columns: Array) -> Array:
        """What the base makes nothing of, of whitened columns, (n,) or (n, p)."""
        return np.asarray(columns - self.base @ (self._inverse @ (self.base.T @ columns)))

    @cached_property
    def _inverse(self) -> Array:
        """Of the base's normal matrix, its prior included, (q, q)."""
        normal = self.base.T @ self.base + np.eye(self.base.shape[1])
        return np.asarray(np.linalg.inv(normal), dtype=np.float64)

    @cached_property
    def alone(self) -> Array:
        """What is left where only what is not exactly known is fitted, whitened, (n,)."""
        return self.left(np.zeros_like(self.residual))

    def explained(self, change: Array) -> float:
        """Share of these squares, those of noise included, that a change of all values explains."""
        left = self.left(change)
        return 1.0 - float(left @ left) / max(float(self.alone @ self.alone), 1e-300)

    @cached_property
    def blocks(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Stretch and moment of each row."""
        stretch, moment = [], []
        for simulation in self.dataset.simulations:
            time = np.concatenate([channel.time for channel in simulation.channels])
            share = _STRETCHES * time / (time.max() + 1e-9)
            stretch.append(np.minimum(share.astype(np.intp), _STRETCHES - 1))
            moment.append((time / _MOMENT).astype(np.intp) % _MOMENTS)
        return np.concatenate(stretch), np.concatenate(moment)


def _scatter(value: Array, residual: Array, rounding: float) -> float:
    """Noise of a channel from one sample to the next, and what no simulator reproduces of it."""
    steps = np.abs(np.diff(residual))
    noise = max(0.5 * robust_scale(steps) ** 2, 0.5 * float(np.mean(steps**2)) / 4.0)
    return float(np.sqrt(max(noise, rounding) + (_INEXACT * np.std(value)) ** 2)) + 1e-12


def whitened(columns: Matrix, weight: Array) -> NDArray[np.float32]:
    """Columns (n, p) times weights (n,)."""
    return np.asarray(columns * weight.astype(np.float32)[:, None], dtype=np.float32)


def inflations(dataset: Dataset, left: Array) -> list[tuple[slice, float]]:
    """By channel: variance of what is left over that of its noise, times its correlation time."""
    found = []
    for part in rows_of(dataset.channels):
        lags = min(_LAGS, (part.stop - part.start) // 4 + 1)
        time = autocorrelation_time([left[part]], lags, _NEGLIGIBLE)
        found.append((part, max(float(np.mean(left[part] ** 2)), 1.0) * time))
    return found


@frozen
class Prediction:
    """What columns predict of blocks left out one by one."""

    share: float  # of what is left beyond noise; see `predicted`
    size: float  # of the columns' prior standard deviations, with which they predict most


def predicted(rest: Remainder, columns: Sequence[Matrix], labels: NDArray[np.intp]) -> Prediction:
    """Share of what is left, beyond noise, that columns predict of blocks left out one by one.

    Columns whose units may be as large as their prior allows follow what is left of the other
    blocks wherever that tells little, and are far off in this one. So their prior is chosen with
    it, in steps of half a decade (empirical Bayes by cross-validation).

    The share is at most 1, at least -1: predicted worse than by nothing. It is NaN where no more
    than noise is left.
    """
    without = _squares_unfitted(rest.residual, rest.base, labels, 0, (1.0,))[0]
    joined = rest.beside([whitened(part, rest.weight) for part in columns])
    known = rest.base.shape[1]
    # Channel by channel: one that the model knows better than its noise hides none of the others'.
    parts = rows_of(rest.dataset.channels)
    sums = [(float(without[part].sum()), int(part.stop - part.start)) for part in parts]
    beyond = sum(
        square - count
        for square, count in sums
        if square - count > _SURELY * math.sqrt(2.0 * count)
    )
    if not beyond:
        return Prediction(math.nan, 1.0)
    found = [
        Prediction(max(-1.0, min(1.0, float((without - beside).sum()) / beyond)), size)
        for beside, size in zip(
            _squares_unfitted(rest.residual, joined, labels, known, _SIZES), _SIZES, strict=True
        )
    ]
    return max(found, key=lambda item: item.share)


def _squares_unfitted(
    residual: Array,
    columns: Matrix,
    labels: NDArray[np.intp],
    known: int,
    sizes: Sequence[float],
) -> list[Array]:
    """Squares of what columns leave of each block, fitted to the others, (n,), for each size.

    All but the first `known` columns are times that size.
    """
    blocks = [labels == label for label in np.unique(labels)]
    grams = [Gram.of(columns[rows], residual[rows]) for rows in blocks]
    matrix = np.sum([gram.matrix for gram in grams], axis=0)
    vector = np.sum([gram.vector for gram in grams], axis=0)
    scales = [np.where(np.arange(columns.shape[1]) < known, 1.0, size) for size in sizes]
    left = [residual.copy() for _ in sizes]
    for rows, gram in zip(blocks, grams, strict=True):
        others = Gram(matrix - gram.matrix, vector - gram.vector, 0.0)
        units = [scale * solve(others.scaled(scale), range(len(scale))).mean for scale in scales]
        for one, shown in zip(left, product(columns[rows], np.stack(units, axis=1)).T, strict=True):
            one[rows] -= shown
    return [np.asarray(one**2) for one in left]
