"""What the suite reads out of a message, alike for rclpy's and for rosbags' message objects.

Every function returns plain numbers or raises `Unusable` with the reason: a node warns and goes on.
"""

import math
from collections.abc import Sequence
from typing import Any

from attrs import frozen

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.messages.turns import Turns

Triple = tuple[float, float, float]
NAN = float("nan")
_UNKNOWN = (NAN, NAN, NAN)


@frozen
class Largest:
    """What no sensor of a robot on wheels gives: more is damage, and no sample."""

    angle: float = 1e9  # rad
    speed: float = 1e5  # rad/s
    current: float = 1e5  # A
    voltage: float = 1e5  # V
    power: float = 1e7  # W
    twist: float = 1e3  # m/s or rad/s
    rate: float = 1e3  # rad/s
    force: float = 1e4  # m/s^2


LARGEST = Largest()


class Unusable(ValueError):
    """A message that says nothing usable, and why."""


# What reading a malformed message may raise; no message may stop a stage or a tool.
MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def header_stamp_ns(message: Any) -> int | None:
    """Return the stamp of a message's header [ns]: 0 where it is unset, None without a header."""
    try:
        stamp = message.header.stamp
    except AttributeError:
        return None
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def stamp_of(message: Any, receive_ns: int, fallback: bool = False) -> int:
    """Stamp of a message [ns]; the receive time for types without one.

    `fallback`: the receive time also where the stamp was left zero, as commands often are.
    """
    stamp = header_stamp_ns(message)
    if stamp is None or (fallback and stamp == 0):
        return receive_ns
    return stamp


def twist_of(message: Any) -> Triple:
    """v_x, v_y [m/s], omega_z [rad/s] of a Twist or TwistStamped."""
    twist = getattr(message, "twist", message)
    values = (float(twist.linear.x), float(twist.linear.y), float(twist.angular.z))
    for value in values:
        _check(value, LARGEST.twist, "the twist")
    return values


@frozen
class Wheels:
    """Angle, speed and effort of the wheels in one JointState, NaN for what is missing."""

    position: Triple
    velocity: Triple
    effort: Triple
    absent: tuple[str, ...] = ()  # wheels that are not among the names


class WheelFinder:
    """Reads the wheels of a JointState by name; other joints may be there, in any order.

    Angles that begin anew each turn go on: one stream, message by message.
    """

    def __init__(self, wheel_names: tuple[str, str, str]) -> None:
        self._wheels = wheel_names
        self._names: Sequence[str] = ()
        self._places: tuple[int | None, ...] = ()
        self._missing: tuple[str, ...] = wheel_names
        self._turns = Turns(len(wheel_names))
        self.is_heard = False  # whether wheels ever came

    def is_others(self, message: Any) -> bool:
        """Whether a message is of other joints alone, as an arm sends."""
        self._find(message.name)
        return bool(self._names) and len(self._missing) == len(self._wheels)

    def read(self, message: Any) -> Wheels:
        """Wheels of a message; raises Unusable if none is there or the lengths disagree."""
        self._find(message.name)
        if len(self._missing) == len(self._wheels):
            found = ", ".join(self._names) or "no joint"
            raise Unusable(f"none of {', '.join(self._wheels)} is there, but {found}")
        count = len(self._names)
        position = self._pick(message.position, count, "position", LARGEST.angle)
        velocity = self._pick(message.velocity, count, "velocity", LARGEST.speed)
        effort = self._pick(message.effort, count, "effort", LARGEST.current)
        a, b, c = self._turns.go_on(position, velocity)
        self.is_heard = True
        return Wheels((a, b, c), velocity, effort, self._missing)

    def _find(self, names: Sequence[str]) -> None:
        if names == self._names:
            return
        self._names = names = list(names)
        self._places = tuple(
            names.index(wheel) if wheel in names else None for wheel in self._wheels
        )
        self._missing = tuple(wheel for wheel in self._wheels if wheel not in names)

    def _pick(self, values: Sequence[float], count: int, field: str, largest: float) -> Triple:
        if len(values) == 0:
            return _UNKNOWN
        if len(values) != count:
            raise Unusable(f"{count} names but {len(values)} values in {field}")
        # Items of an array one by one are slow, and this is done for every message.
        plain = values.tolist() if hasattr(values, "tolist") else values
        a, b, c = self._places
        first = NAN if a is None else plain[a]
        second = NAN if b is None else plain[b]
        third = NAN if c is None else plain[c]
        if abs(first) <= largest and abs(second) <= largest and abs(third) <= largest:
            return first, second, third
        return _within(first, largest), _within(second, largest), _within(third, largest)


def _check(value: float, largest: float, what: str) -> None:
    if not math.isfinite(value):
        raise Unusable(f"{what} is not finite")
    if abs(value) > largest:
        raise Unusable(f"{what} is {value:g}, more than can be")


def _within(value: float, largest: float) -> float:
    """The value, NaN where a sensor cannot have measured it."""
    number = float(value)
    return number if abs(number) <= largest else NAN


def battery_of(message: Any) -> tuple[float, float]:
    """Voltage [V], NaN if unknown, and current [A], negative while drawing."""
    voltage, current = float(message.voltage), float(message.current)
    _check(current, LARGEST.current, "the current")
    if not math.isnan(voltage):
        _check(voltage, LARGEST.voltage, "the voltage")
    return voltage, current


def numbers_of(message: Any, least: int) -> tuple[float, ...]:
    """Numbers of a Float64MultiArray, at least so many."""
    values = tuple(_within(value, LARGEST.power) for value in message.data)
    if len(values) < least:
        raise Unusable(f"{len(values)} values, needs {least}")
    return values
