"""Wheel speeds that a recording's commands lead to, by the description as it is."""

import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.astray import otherwise_than_commanded
from tomr_power_model.drive.motion import measured_speed
from tomr_power_model.drive.quality import Finding
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.model.commanded import CommandPath, CommandTiming, Seen
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_TICK = 0.05  # s


def lost_wheels(drive: Drive, robot: Robot) -> Iterator[Finding]:
    """Wheels that do not turn as the commands make them, or by other radii or another ramp."""
    if len(drive.command_time):
        time, expected = expected_speed(drive, robot)
        yield from otherwise_than_commanded(drive, robot, time, expected)


def expected_speed(drive: Drive, robot: Robot) -> tuple[Array, Array]:
    """Middles of ticks [s], (n,), and the wheels' mean speeds in them [rad/s], (n, 3)."""
    motion = CommandPath(robot, CommandTiming(to_ns(_TICK)))
    pending = deque(zip(drive.command_time, drive.command, strict=True))
    time = np.arange(drive.encoder_time[0], drive.encoder_time[-1], _TICK) + _TICK
    speeds = np.full((len(time), WHEELS), np.nan)
    x, y, yaw = (float(value) for value in wheels_to_twist(robot) @ measured_speed(drive)[0])
    first = Seen((x, y, yaw), (math.nan,) * WHEELS, math.nan)
    for row, tick in enumerate(time):
        while pending and pending[0][0] <= tick:
            stamp, (vx, vy, wz) = pending.popleft()
            motion.command(to_ns(stamp), (float(vx), float(vy), float(wz)))
        step = motion.over(to_ns(tick), first)
        if step is not None:
            speeds[row] = step.speed
    return time - 0.5 * _TICK, speeds
