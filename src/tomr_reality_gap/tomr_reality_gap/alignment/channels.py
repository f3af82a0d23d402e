"""A recording as channels: what was measured when, each compared with a model in its own unit."""

from typing import Literal

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period
from tomr_power_model.drive.quantum import quantum_of
from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Kind = Literal["power", "current", "total", "voltage", "speed", "yaw"]

# What motors draw, power or else current, and what the robot draws: the kinds that are scored.
MOTOR_KINDS: tuple[Kind, ...] = ("power", "current")
DRAWN_KINDS: tuple[Kind, ...] = (*MOTOR_KINDS, "total")

_BLOCK = 0.05  # s, over which wheel speed and yaw rate are averaged
_FEWEST = 10  # values of a channel
_GAP = 3.0  # usual periods between two encoder samples: a longer time is a gap, and stays one


@frozen
class Channel:
    """One measured quantity; times in seconds since the recording's start."""

    name: str  # as in the report: a topic, or a wheel and what of it
    kind: Kind
    wheel: int | None
    unit: str
    time: Array  # end of what the value is a mean of [s], (n,)
    span: Array  # how long that is [s], (n,)
    value: Array  # (n,)
    quantum: float = 0.0  # of a value, where it is coarse

    def at(self, rows: NDArray[np.bool_]) -> "Channel":
        """Some of its values."""
        return evolve(self, time=self.time[rows], span=self.span[rows], value=self.value[rows])

    def rounding(self, value: Array) -> float:
        """Mean square by which the nearest levels of a coarse sensor are off true values, (n,).

        Values that hardly change lie anywhere between two levels, and stay there.
        """
        if not self.quantum:
            return 0.0
        return float(np.mean((value - self.quantum * np.round(value / self.quantum)) ** 2))


def channels_of(recorded: Drive, robot: Robot) -> tuple[Channel, ...]:
    """All channels of a recording that hold enough to determine their noise."""
    found = [*_powers(recorded, robot), *_speeds(recorded, robot)]
    if len(recorded.imu_time) > 1:
        found.append(_blocks(recorded))
    known = (channel.at(np.isfinite(channel.value)) for channel in found)
    return tuple(channel for channel in known if len(channel.time) >= _FEWEST)


def _powers(recorded: Drive, robot: Robot) -> list[Channel]:
    kind: Kind = "power"
    unit, least = "W", 0.0
    if robot.measurement.quantity == "motor_current":
        kind, unit, least = "current", "A", robot.sensors.current_resolution
    window = robot.sensors.power_window
    time, total = recorded.power_time, recorded.total_time
    span, total_span = np.full(len(time), window), np.full(len(total), window)
    volts = recorded.total_voltage
    motors = [
        Channel(f"{topic}/{kind}", kind, wheel, unit, time, span, power, max(least, quantum))
        for wheel, (topic, power, quantum) in enumerate(
            zip(robot.wheel_topics, recorded.power.T, _quanta(recorded), strict=True)
        )
    ]
    coarse = _quantum(recorded.total / np.where(volts > 0.0, volts, np.nan), recorded.total)
    return [
        *motors,
        Channel("battery_state", "total", None, "W", total, total_span, recorded.total, coarse),
        Channel("battery_state voltage", "voltage", None, "V", total, total_span, volts),
    ]


def _quanta(recorded: Drive) -> list[float]:
    """Of the motors' power or current."""
    pairs = zip(recorded.reading.T, recorded.power.T, strict=True)
    return [_quantum(reading, power) for reading, power in pairs]


def _quantum(reading: Array, drawn: Array) -> float:
    """Of what is drawn, from readings of a current, or of that itself."""
    per_reading = np.abs(drawn[reading != 0.0] / reading[reading != 0.0])
    known = per_reading[np.isfinite(per_reading)]
    return quantum_of(reading) * float(np.median(known)) if len(known) else 0.0


def _blocks(recorded: Drive) -> Channel:
    """The gyro's yaw rate, means over blocks of `_BLOCK`."""
    time, rate = recorded.imu_time, recorded.yaw_rate
    every = max(1, round(_BLOCK / median_period(time)))
    rows = np.arange(len(time) // every * every).reshape(-1, every)
    usual = every * median_period(time)
    whole = np.ptp(time[rows], axis=1) < usual
    middle, value = time[rows].mean(axis=1)[whole], rate[rows].mean(axis=1)[whole]
    span = np.full(len(middle), usual)
    return Channel("imu/data", "yaw", None, "rad/s", middle + 0.5 * usual, span, value)


def _speeds(recorded: Drive, robot: Robot) -> list[Channel]:
    """Mean wheel speeds between encoder samples, from angles; the sample's speed without them.

    A robot whose description gives the quantum of its speeds measures them by themselves: then it
    is they that its drivers follow.
    """
    found = []
    quantum = robot.sensors.velocity_resolution
    for wheel, name in enumerate(robot.wheel_names):
        known = np.isfinite(recorded.position[:, wheel])
        time = recorded.encoder_time
        is_measured = quantum > 0.0 and bool(np.isfinite(recorded.velocity[:, wheel]).any())
        if known.sum() > 1 and not is_measured:
            every = max(1, round(_BLOCK / median_period(time[known])))
            time, angle = time[known][::every], recorded.position[known, wheel][::every]
            span = np.diff(time)
            rows = span < _GAP * np.median(span)
            speed = np.diff(angle)[rows] / span[rows]
            found.append(Channel(name, "speed", wheel, "rad/s", time[1:][rows], span[rows], speed))
        else:
            span, speed = np.zeros(len(time)), recorded.velocity[:, wheel]
            found.append(Channel(name, "speed", wheel, "rad/s", time, span, speed, quantum))
    return found
