"""When the encoder samples of the last moments were taken, where their stamps jitter."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.dejitter import UNSETTLED, Grid, grid_of, is_jitter
from tomr_power_model.drive.quantum import count_of

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
_KEPT = 200  # samples whose stamps are looked at
_LEAST = 50  # before any are
_EVERY = 25  # samples: how often
_STEADY = 0.04  # s before a sample that show how fast the wheels turn, at least one period
_CLEARLY = 0.05  # squared distances: a sample fits one time much better than another


class RecentStamps:
    """The stamps of the last moments, dejittered; driven by samples alone."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Triple]] = deque(maxlen=_KEPT)
        self._count = 0
        self._jitter = False
        self._grid: Grid | None = None
        self._origin = 0  # of the grid [ns]
        self._shift = 0  # of the phase since the grid was fitted [ns]
        self._late = 0  # newest stamps that are taken for late ones
        self._times: dict[int, int] = {}  # of the samples [ns], where stamps jitter
        self.resolution = 0.0  # of the angles, as they show it [rad]; 0 where they have not moved

    def add(self, stamp_ns: int, position: Triple) -> None:
        """Take a sample newer than those before."""
        self._samples.append((stamp_ns, position))
        self._count += 1
        if self._grid is not None:
            time = self._times[stamp_ns] = self._time(self._grid, -1)
            self._late = self._late + 1 if stamp_ns - time > 1e9 * self._grid.reach else 0
        is_shifted = self._late > UNSETTLED  # so many in a row are not late
        if is_shifted or (self._count % _EVERY == 0 and len(self._samples) >= _LEAST):
            self._look()

    def times(self, stamps_ns: list[int]) -> list[int]:
        """When samples with such stamps were taken [ns]: the stamps, where they can be trusted."""
        times = [self._times.get(stamp, stamp) for stamp in stamps_ns]
        return times if len(set(times)) == len(times) else stamps_ns

    def _time(self, grid: Grid, number: int) -> int:
        """When one of the newest samples was taken [ns]: on the grid, or that has shifted.

        A stamp off the grid is late, or right; how far the wheels have turned tells which.
        """
        stamp, last = self._samples[number][0], self._samples[number - 1][0]
        origin, period = self._origin + self._shift, round(1e9 * grid.period)
        nearest = origin + round(1e9 * grid.nearest(1e-9 * (stamp - origin)))
        is_off = abs(stamp - nearest) > 1e9 * grid.reach
        # Where one seems to be missing, this one may be as late as a period.
        is_missing = round((nearest - self._times.get(last, last)) / period) == 2
        if not is_off and not is_missing:
            return nearest
        first = number - 1 - min(max(round(_STEADY / grid.period), 1), _LEAST // 2)
        off = [self._off_steady(first, number, time) for time in (nearest, nearest - period, stamp)]
        if not is_off:
            return nearest - period if off[1] < _CLEARLY * off[0] else nearest
        if off[2] <= min(off[:2]):
            self._shift += stamp - nearest
            return stamp
        return nearest if off[0] < off[1] else nearest - period

    def _off_steady(self, start: int, number: int, time_ns: int) -> float:
        """How far the angles of a sample, if taken at a time, are off a steady motion [rad^2]."""
        first, last, new = (self._samples[index] for index in (start, number - 1, number))
        since, until = self.times([first[0], last[0]])
        share = (time_ns - until) / (until - since)
        off = (
            end - middle - share * (middle - start)
            for start, middle, end in zip(first[1], last[1], new[1], strict=True)
        )
        return sum(angle * angle for angle in off if angle == angle)  # not NaN

    def _look(self) -> None:
        positions = np.array([position for _, position in self._samples])
        self.resolution = count_of(positions) or self.resolution
        stamps_ns = [stamp for stamp, _ in self._samples]
        self._origin, self._shift = stamps_ns[0], 0
        stamps = 1e-9 * (np.array(stamps_ns) - self._origin)
        grid = grid_of(stamps)
        if grid is not None:
            found = is_jitter(stamps, grid, positions)
            # At rest nothing can be seen: what was known stays.
            self._jitter = self._jitter if found is None else found
        self._grid = grid if self._jitter else None
        self._times = {}
        if self._grid is None:
            return
        times = (self._origin + np.round(1e9 * self._grid.times).astype(np.int64)).tolist()
        self._times = dict(zip(stamps_ns[:-UNSETTLED], times[:-UNSETTLED], strict=True))
        for number in range(-UNSETTLED, 0):
            self._times[stamps_ns[number]] = self._time(self._grid, number)
