"""A recording's commands as set points of the drivers, cut into stretches that run side by side."""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.motion import turned_angle, wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import twist_to_wheels, wheels_to_twist
from tomr_power_model.response.many import Stretches, step_of
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_STRETCH = 3.0  # s, at least
_MOVING = 0.2  # rad/s
_FORGETS = 7.0  # time constants of the slowest mode of the loop
_WARM_UP = (0.5, 3.0)  # s
_SPAN = 0.06  # s, of the fit to the encoders where a stretch begins


@frozen
class Timeline:
    """Driver periods of a whole recording, and how they are cut; period k ends at (k + 1) h.

    A stretch runs `warm` periods before its first, so that what it began with is forgotten. A
    wheel that stands forgets nothing: its integral stays. So a stretch begins where all wheels
    have moved for as long as the warm-up, if there is such a place; anywhere, without an integral.
    """

    start: float  # of the first period [s]
    period: float  # s
    count: int  # periods that count
    warm: int
    first: NDArray[np.intp]  # of each stretch, (c,)
    length: int  # of the longest stretch

    @property
    def begins(self) -> Array:
        """When each stretch starts to run, warm-up included [s], (c,)."""
        return np.asarray(self.start + self.period * (self.first - self.warm))

    @property
    def middle(self) -> Array:
        """Middles of the periods that count [s], (count,)."""
        return np.asarray(self.start + self.period * (np.arange(self.count) + 0.5))

    def cut(self, series: Array) -> Array:
        """(warm + count, ...) -> (c, warm + length, ...); the end is repeated."""
        rows = self.first[:, None] + np.arange(self.warm + self.length)
        return np.asarray(series[np.minimum(rows, len(series) - 1)])

    def joined(self, pieces: Array) -> Array:
        """(p (warm + length), v, c, ...) -> (p count, v, ...) with p substeps per period."""
        parts = len(pieces) // (self.warm + self.length)
        periods, part = np.divmod(np.arange(self.count * parts), parts)
        owner = np.searchsorted(self.first, periods, side="right") - 1
        rows = (periods - self.first[owner] + self.warm) * parts + part
        return np.asarray(pieces[rows, :, owner])


def timeline_of(recorded: Drive, robot: Robot) -> Timeline:
    """Driver periods from the first encoder sample to the last measurement."""
    period = step_of(robot)
    last = max(float(time[-1]) for time in _times(recorded))
    count = math.ceil(last / period) + 2
    warm = math.ceil(_memory(robot) / period)
    start = _phase(recorded.command_time + robot.controller.delay, period)
    whole = Timeline(start, period, count, warm, np.zeros(1, dtype=np.intp), count)
    twist = ramped(recorded, robot, whole)
    moving = np.all(np.abs(twist @ twist_to_wheels(robot, nominal=True).T) > _MOVING, axis=1)
    moving |= not robot.controller.integral
    since = np.arange(len(moving)) - np.maximum.accumulate(
        np.where(moving, -1, np.arange(len(moving)))
    )
    good = np.flatnonzero(since[warm:] > warm)
    first, least = [0], math.ceil(_STRETCH / period)
    while len(later := good[good >= first[-1] + least]) and later[0] < count - least // 2:
        first.append(int(later[0]))
    length = int(np.max(np.diff([*first, count])))
    return Timeline(start, period, count, warm, np.array(first, dtype=np.intp), length)


def _times(recorded: Drive) -> list[Array]:
    found = [recorded.encoder_time, recorded.power_time, recorded.total_time, recorded.yaw_time]
    return [time for time in found if len(time)]


def _memory(robot: Robot) -> float:
    """How long the loop remembers [s]: its slow mode decays with k_i / (k + k_p)."""
    motor = robot.motors[0]
    gain, rate = robot.controller.proportional, robot.controller.integral
    slow = (motor.wheel_constant + gain) / rate if rate else _WARM_UP[0] / _FORGETS
    return float(np.clip(_FORGETS * slow, *_WARM_UP))


def ramped(recorded: Drive, robot: Robot, timeline: Timeline) -> Array:
    """Set point of the body twist in each period, from `warm` periods before the start, (m, 3)."""
    wanted = _held(recorded, timeline, robot.controller.delay)
    limit = robot.controller.acceleration_limit
    if not limit:
        return wanted
    linear = limit * timeline.period
    yaw = linear / robot.robot_radius
    ramp = np.empty_like(wanted)
    x, y, z = wanted[0]
    for row, (a, b, c) in enumerate(wanted.tolist()):
        dx, dy = a - x, b - y
        length = math.hypot(dx, dy)
        part = linear / length if length > linear else 1.0
        x, y = x + part * dx, y + part * dy
        z += min(max(c - z, -yaw), yaw)
        ramp[row] = x, y, z
    return ramp


def _held(recorded: Drive, timeline: Timeline, delay: float) -> Array:
    """Command of each period, (warm + count, 3): from the period that begins nearest to it on."""
    begins = timeline.start + timeline.period * np.arange(-timeline.warm, timeline.count)
    times = recorded.command_time + delay
    latest = np.searchsorted(times, begins + 0.5 * timeline.period, side="right")
    return np.concatenate([np.zeros((1, 3)), recorded.command])[latest]


def _phase(times: Array, period: float) -> float:
    """Where in a driver's period commands come, on the whole [s], in (-period, 0]."""
    if not len(times):
        return 0.0
    turn = np.exp(2j * np.pi * times / period).sum()
    return float(np.angle(turn) / (2.0 * np.pi) % 1.0 - 1.0) * period


def stretches_of(recorded: Drive, robot: Robot, timeline: Timeline, set_twist: Array) -> Stretches:
    """What the loops are driven with, beginning with the motion that the encoders tell.

    Args:
        recorded: the recording.
        robot: as its drivers believe it to be.
        timeline: how it is cut.
        set_twist: of `ramped`.
    """
    begins = np.maximum(timeline.begins, 0.0)
    motion = wheel_motion(
        recorded.encoder_time, recorded.position, recorded.velocity, begins, _SPAN
    )
    still = ~np.isfinite(motion.speed).all(axis=1)
    speed, acceleration = motion.speed.copy(), motion.acceleration.copy()
    speed[still], acceleration[still] = 0.0, 0.0
    acceleration[np.abs(speed) < _MOVING] = 0.0
    turned = np.stack([turned_angle(recorded, wheel) for wheel in range(WHEELS)], axis=1)
    angle = np.stack(
        [np.interp(begins, recorded.encoder_time, turned[:, wheel]) for wheel in range(WHEELS)],
        axis=1,
    )
    heading = np.interp(
        begins, recorded.encoder_time, (turned - turned[0]) @ wheels_to_twist(robot)[2]
    )
    set_speed = timeline.cut(set_twist @ twist_to_wheels(robot, nominal=True).T)
    every = timeline.start + timeline.period * np.arange(-timeline.warm, timeline.count)
    told = [np.interp(every, recorded.encoder_time, turned[:, wheel]) for wheel in range(WHEELS)]
    return Stretches(
        set_speed[None],
        speed,
        acceleration,
        angle,
        heading,
        told=timeline.cut(np.stack(told, axis=1)),
    )
