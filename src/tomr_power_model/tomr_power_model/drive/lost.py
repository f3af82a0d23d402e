"""Commands that were sent and not recorded: what the robot did then, no simulation can know."""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_NEAR = 0.2  # of a period: so far from a whole number of them a regular sender's times lie
_REGULAR, _SINGLE = 0.9, 0.25  # shares of intervals that are whole numbers, and one period
_LATE = 1.5  # periods
_WAY = 0.005  # m at a rim, by which it goes wrong
_AFTER = 1.0  # s until robot and simulation do the same again


def lost_commands(drive: Drive, robot: Robot) -> list[tuple[float, float]]:
    """Spans of time [s] in which it is not known what was commanded.

    Of a sender with a rate; one that sends when something changes leaves silences too. Where the
    command is the same before and after, nothing was lost.
    """
    steps = np.diff(drive.command_time)
    period = float(np.quantile(steps, 0.05)) if len(steps) else 0.0
    if period <= 0.0:
        return []
    periods = steps / period
    whole = np.abs(periods - np.round(periods)) < _NEAR
    if np.mean(whole) < _REGULAR or np.mean(periods < _LATE) < _SINGLE:
        return []
    to_rim = robot.wheel_radius * twist_to_wheels(robot, nominal=True)
    changes = np.abs(np.diff(drive.command, axis=0) @ to_rim.T).max(axis=1)
    lost = (periods > _LATE) & (changes * (steps - period) > _WAY)
    return [
        (float(drive.command_time[k]), float(drive.command_time[k + 1]) + _AFTER)
        for k in np.flatnonzero(lost)
    ]
