"""Whether two recordings were driven with the same commands."""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.record import Drive

Array = NDArray[np.float64]

_STEP = 0.01  # s, of the search for the shift between two recordings
_FARTHEST = 2.0  # s
_ALIKE = 0.3  # RMS of the commands' difference over that of the commands


def shift_between(one: Drive, other: Drive) -> float | None:
    """By how much later the other's commands are [s], between encoder starts; None: others."""
    first, second = one.command_time, other.command_time
    if min(len(first), len(second)) < 2:
        return None
    length = min(first[-1] - first[0], second[-1] - second[0])
    if length < 0.5 * max(first[-1] - first[0], second[-1] - second[0]):
        return None
    guess = second[0] - first[0]
    grid = np.arange(first[0] + _FARTHEST, first[0] + length - _FARTHEST, _STEP)
    if len(grid) < _FARTHEST / _STEP:
        grid = np.arange(first[0], first[0] + length, _STEP)
    wanted = _held(one, grid)
    scale = float(np.sqrt(np.mean(wanted**2))) + 1e-9
    lags = guess + _STEP * np.arange(-round(_FARTHEST / _STEP), round(_FARTHEST / _STEP) + 1)
    errors = [float(np.mean((_held(other, grid + lag) - wanted) ** 2)) for lag in lags]
    best = int(np.argmin(errors))
    if np.sqrt(errors[best]) >= _ALIKE * scale:
        return None
    times = second - lags[best]
    near = np.clip(np.searchsorted(first, times), 1, len(first) - 1)
    apart = np.where(times - first[near - 1] < first[near] - times, first[near - 1], first[near])
    return float(lags[best] + np.median(times - apart))


def _held(recorded: Drive, time: Array) -> Array:
    """Commands in force, (n, 3)."""
    rows = np.searchsorted(recorded.command_time, time + 1e-9, side="right") - 1
    return recorded.command[np.clip(rows, 0, None)]
