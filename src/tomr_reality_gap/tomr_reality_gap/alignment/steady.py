"""Stamps that jitter although the samples do not: put back on the grid that they scatter around."""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.calibration.recorded import Recorded

Array = NDArray[np.float64]

_SCATTER = 0.35  # of a period: stamps that scatter wider have no grid
_MOVING = 0.3  # rad/s


def steady(time: Array) -> Array:
    """Stamps on the straight line through them, one step per period; as given if there is none."""
    if len(time) < 10:
        return time
    period = float(np.median(np.diff(time)))
    for _ in range(2):
        number = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(np.diff(time) / period), 1))])
        period, start = (float(value) for value in np.polyfit(number, time, 1))
    grid = start + period * number
    if float(np.quantile(np.abs(time - grid), 0.99)) > _SCATTER * period:
        return time
    return np.asarray(grid)


def steadied(recorded: Recorded) -> tuple[Recorded, bool]:
    """The recording with steady encoder and command stamps, if that makes its motion smoother."""
    grid = steady(recorded.encoder_time)
    if _roughness(grid, recorded.position) >= 0.9 * _roughness(
        recorded.encoder_time, recorded.position
    ):
        return recorded, False
    commands = steady(recorded.command_time)
    yaw = steady(recorded.yaw_time)
    return evolve(recorded, encoder_time=grid, command_time=commands, yaw_time=yaw), True


def _roughness(time: Array, position: Array) -> float:
    """How far samples lie off the line between their neighbours, while wheels turn."""
    if len(time) < 10:
        return 0.0
    left, right = time[1:-1] - time[:-2], time[2:] - time[1:-1]
    between = (position[:-2] * right[:, None] + position[2:] * left[:, None]) / (left + right)[
        :, None
    ]
    off = np.abs(position[1:-1] - between)
    speed = np.abs(position[2:] - position[:-2]) / (left + right)[:, None]
    moving = off[np.nan_to_num(speed) > _MOVING]
    return float(np.median(moving)) if len(moving) else 0.0
