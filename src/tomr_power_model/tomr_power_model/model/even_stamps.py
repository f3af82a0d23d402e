"""Stamps of encoders that jitter although the samples do not: told, and put on their even grid.

A driver that samples evenly and stamps when it gets to it scatters its stamps around a grid. Half a
millisecond of scatter at 100 Hz is 2 % of the speed over 70 ms, the same for all wheels: that looks
like slip. Whether the samples or only their stamps are uneven shows in motion, which is smoother on
the times at which it was really sampled.
"""

from collections import deque

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

_KEPT = 200  # samples that are looked at
_LEAST = 50
_EVERY = 25  # samples: how often
_SCATTER = 0.35  # of a period: stamps that scatter wider have no grid
_SMOOTHER = 0.8  # share of roughness that the grid must leave
_MOVING = 0.3  # rad/s
_TOLD = 30  # samples in motion that it takes to tell


@frozen
class _Grid:
    """Times origin + start + period n [ns]."""

    origin: int
    start: float
    period: float

    def nearest(self, stamp_ns: int) -> int:
        since = stamp_ns - self.origin - self.start
        number = round(since / self.period)
        if abs(since - number * self.period) > _SCATTER * self.period:
            return stamp_ns  # not of this grid: the driver has started afresh
        return self.origin + round(self.start + self.period * number)


class EvenStamps:
    """Watches samples as they come; tells when they were taken. Driven by samples alone."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, tuple[float, float, float]]] = deque(maxlen=_KEPT)
        self._count = 0
        self._is_even = False
        self._grid: _Grid | None = None

    def add(self, stamp_ns: int, position: tuple[float, float, float]) -> None:
        """Take a sample newer than those before."""
        self._samples.append((stamp_ns, position))
        self._count += 1
        if self._count % _EVERY == 0 and len(self._samples) >= _LEAST:
            self._look()

    def times(self, stamps_ns: list[int]) -> list[int]:
        """When samples with such stamps were taken [ns]: the stamps, where they can be trusted."""
        if self._grid is None:
            return stamps_ns
        times = [self._grid.nearest(stamp) for stamp in stamps_ns]
        return times if len(set(times)) == len(times) else stamps_ns

    def _look(self) -> None:
        origin = self._samples[0][0]
        stamps = np.array([stamp - origin for stamp, _ in self._samples], dtype=np.float64)
        steps = np.diff(stamps)
        period = float(np.median(steps))
        number = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(steps / period), 1.0))])
        period, start = (float(value) for value in np.polyfit(number, stamps, 1))
        grid = start + period * number
        if float(np.quantile(np.abs(stamps - grid), 0.99)) > _SCATTER * period:
            self._grid = None
            return
        positions = np.array([position for _, position in self._samples])
        even, told = _roughness(grid, positions), _roughness(stamps, positions)
        if told > 0.0:
            self._is_even = even < _SMOOTHER * told
        self._grid = _Grid(origin, start, period) if self._is_even else None


def _roughness(time: Array, position: Array) -> float:
    """How far samples lie off the line between their neighbours [rad]; 0 if little moves."""
    left, right = time[1:-1] - time[:-2], time[2:] - time[1:-1]
    span = (left + right)[:, None]
    between = (position[:-2] * right[:, None] + position[2:] * left[:, None]) / span
    off = np.abs(position[1:-1] - between)
    moving = off[np.nan_to_num(np.abs(position[2:] - position[:-2]) / span) > _MOVING * 1e-9]
    return float(np.median(moving)) if len(moving) >= _TOLD else 0.0
