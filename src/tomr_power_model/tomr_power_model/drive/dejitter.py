"""Stamps that jitter although the samples do not: recognised, and put on their even grid.

A driver that samples evenly and stamps when it gets to it scatters its stamps around a grid. Half a
millisecond of scatter at 100 Hz is 2 % of the speed over 70 ms, the same for all wheels: that looks
like slip. Whether the samples or only their stamps are uneven shows in motion: what the stamps are
off the grid by is in the angles, or it is not, however coarse these are.

Pure functions, for whole recordings and for the last moments of a live stream alike.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FEWEST = 10  # stamps
_SCATTER = 0.35  # of a period: stamps that scatter wider have no grid
_MOST = 0.95  # of the stamps scatter no wider; the others are late
_GAP = 5.5  # periods: after a longer silence the driver may have started afresh
UNSETTLED = 2  # late stamps in a row that shift no phase: of the newest it does not show yet
_FEW = 2 * UNSETTLED + 1  # stamps that have a median phase
_SHIFT = 4.0  # standard deviations of the stamps that a phase shifts by at least
_LEAST_SHIFT = 0.02  # of a period
_NORMAL = 1.4826  # standard deviation over median magnitude
_MOVING = 0.3  # rad/s: the single counts of a slower wheel show nothing
_ENOUGH = 30  # samples in motion that it takes to decide
_HALF = 0.5  # between stamps that are right (0) and a grid that is (1)
_SURE = 4.0  # standard errors; neighbours share samples, which these do not count


@frozen
class Grid:
    """The even times of some stamps [s]."""

    times: Array  # (n,)
    period: float
    reach: float  # s: a stamp farther off the grid is late, or the phase has shifted

    def nearest(self, stamp: float) -> float:
        """The grid's time for a further stamp near its end."""
        last = float(self.times[-1])
        return last + round((stamp - last) / self.period) * self.period


def grid_of(stamps: Array) -> Grid | None:
    """The grid around which stamps scatter; None if there is none.

    One period for all of them; a phase of its own after each gap, and after each shift that lasts:
    a loop that sleeps for its period goes on later once it has been late.

    Args:
        stamps: rising [s], (n,).
    """
    if len(stamps) < _FEWEST:
        return None
    steps = np.diff(stamps)
    period = float(np.median(steps))
    reach = _reach(steps / period)
    segment = np.concatenate([[0], np.cumsum(_is_shift(steps / period, reach))])
    count = np.bincount(segment)
    for _ in range(2):
        forward = np.where(np.diff(segment) > 0, 0.0, _forward(steps / period, reach))
        number = np.concatenate([[0.0], np.cumsum(forward)])
        middle, mean = (
            (np.bincount(segment, weights=values) / count)[segment] for values in (number, stamps)
        )
        spread = float(((number - middle) ** 2).sum())
        if spread == 0.0:
            return None
        period = float(((number - middle) * (stamps - mean)).sum()) / spread
    times = mean + period * (number - middle)
    if float(np.quantile(np.abs(stamps - times), _MOST)) > _SCATTER * period:
        return None
    return Grid(times, period, reach * period)


def _reach(steps: Array) -> float:
    """How far stamps scatter at most [periods], from their steps [periods]."""
    off = np.abs(steps - np.maximum(np.round(steps), 1.0))
    deviation = _NORMAL * float(np.median(off)) / np.sqrt(2.0)
    return float(np.clip(_SHIFT * deviation, _LEAST_SHIFT, _SCATTER))


def _forward(steps: Array, reach: float) -> Array:
    """Whole periods between samples, from their stamps' steps [periods]: stamps come late."""
    return np.asarray(np.maximum(np.floor(steps + reach), 1.0))


def _is_shift(steps: Array, reach: float) -> NDArray[np.bool_]:
    """Whether another phase begins with the stamp after each step [periods].

    It does where the median phase of the next few stamps is not that of the last few, after those
    steps around there that are off by so much.
    """
    off = steps - _forward(steps, reach)
    phase = np.concatenate([[0.0], np.cumsum(off)])
    padded = np.pad(phase, _FEW - 1, mode="reflect")
    medians = np.median(np.lib.stride_tricks.sliding_window_view(padded, _FEW), axis=1)
    differ = np.flatnonzero(np.abs(medians[_FEW:] - medians[:-_FEW]) > reach)
    found = steps > _GAP
    if len(differ):
        for around in np.split(differ, np.flatnonzero(np.diff(differ) > 1) + 1):
            by = np.abs(off[around])
            found[around[by >= min(reach, by.max())]] = True
    return np.asarray(found)


def even(stamps: Array) -> Array:
    """Stamps [s] on their grid; as given where there is none."""
    grid = grid_of(stamps)
    return stamps if grid is None else grid.times


def is_jitter(stamps: Array, grid: Grid, position: Array) -> bool | None:
    """Whether samples were taken on the grid and not when stamped; None if that does not show.

    How far a sample lies off the line between its neighbours is regressed on how much of that the
    stamps add to what the grid leaves: all of it where the grid is right, nothing where the stamps
    are. Noise of the angles, that of coarse encoders too, is in neither. The standard error is that
    of clusters: all wheels are read at once.

    Args:
        stamps: [s], (n,).
        grid: of these stamps.
        position: of the wheels at the samples [rad], (n, 3).
    """
    stamped = _off(stamps, position)
    added = stamped - _off(grid.times, position)
    speed = np.abs(position[2:] - position[:-2]) / (grid.times[2:] - grid.times[:-2])[:, None]
    added[~(np.isfinite(added) & (np.nan_to_num(speed) > _MOVING))] = 0.0
    useful = added.any(axis=1)
    if np.count_nonzero(useful) < _ENOUGH:
        return None
    product = (np.nan_to_num(stamped) * added)[useful].sum(axis=1)
    square = (added[useful] ** 2).sum(axis=1)
    share = float(product.sum() / square.sum())
    error = float(np.linalg.norm(product - share * square) / square.sum())
    return share > _HALF if abs(share - _HALF) > _SURE * error else None


def dejitter(stamps: Array, position: Array) -> tuple[Array, bool]:
    """When samples were taken [s], and whether that is other than stamped; as `is_jitter`."""
    grid = grid_of(stamps)
    if grid is None or not is_jitter(stamps, grid, position):
        return stamps, False
    return grid.times, True


def _off(time: Array, position: Array) -> Array:
    """How far samples lie off the line between their neighbours [rad], (n - 2, 3)."""
    left, right = time[1:-1] - time[:-2], time[2:] - time[1:-1]
    span = (left + right)[:, None]
    between = (position[:-2] * right[:, None] + position[2:] * left[:, None]) / span
    return np.asarray(position[1:-1] - between)
