"""Parabolas through the encoder samples of every tick, as `EncoderWindow` fits them."""

from typing import Self

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_training.planar.schedule import TICK
from tomr_training.planar.sensors import ENCODER_RATE

Array = NDArray[np.float64]

_UNIT = 0.05  # s


@frozen
class Fits:
    """Least squares over the last samples of each tick, linear in their values."""

    index: NDArray[np.int64] = field(repr=False)  # of the samples, (ticks, c)
    weights: Array = field(repr=False)  # of value, slope and curvature, (ticks, 3, c)

    @classmethod
    def over(cls, time: Array, ticks: int, window: float) -> Self:
        """Fits to samples at some times (k,) [s], in the `window` before each tick's end [s]."""
        per_tick = round(TICK * ENCODER_RATE)
        # A jittering sample may belong to the tick before.
        last = per_tick * np.arange(1, ticks + 1)[:, None] + 1
        wanted = last + np.arange(-round(window * ENCODER_RATE) - 2, 1)
        index = np.clip(wanted, 0, len(time) - 1)
        tick = TICK * np.arange(1, ticks + 1)[:, None]
        when = time[index]
        inside = (wanted == index) & (when <= tick + 1e-9) & (when > tick - window + 1e-9)
        s = np.where(inside, (when - tick + 0.5 * TICK) / _UNIT, 0.0)
        powers = np.stack([inside * s**k for k in range(5)], axis=1)  # (ticks, 5, c)
        p0, p1, p2, p3, p4 = powers.sum(axis=2).T
        moments = np.array([[p0, p1, p2], [p1, p2, p3], [p2, p3, p4]]).transpose(2, 0, 1)
        known = np.linalg.matrix_rank(moments) == 3
        weights = np.full((ticks, 3, index.shape[1]), np.nan)
        weights[known] = np.linalg.solve(moments[known], powers[known, :3])
        return cls(index, weights * np.array([[1.0], [1.0 / _UNIT], [2.0 / _UNIT**2]]))

    def of(self, tick: int, values: Array) -> tuple[Array, Array, Array]:
        """Value, slope and curvature at a tick's middle, (3,), of its samples' values (c, 3)."""
        offset, slope, curve = self.weights[tick] @ (values - values[-1])
        return values[-1] + offset, slope, curve

    def all(self, values: Array) -> tuple[Array, Array, Array]:
        """The same of all ticks, (ticks, 3), of all samples (k, 3)."""
        chosen = values[self.index]
        found = np.einsum("tdc,tcw->dtw", self.weights, chosen - chosen[:, -1:])
        return chosen[:, -1] + found[0], found[1], found[2]
