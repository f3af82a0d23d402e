"""Messages without ROS: plain nested records that a recording or a node turns into its own kind."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum
from typing import Any

from attrs import frozen

from tomr_power_model.messages.types import BATTERY, DIAGNOSTICS, JOINT_STATE

NANOSECONDS = 1_000_000_000
_NAN = float("nan")


@frozen
class Plain:
    """A message: its type and its fields; a field may hold further messages or lists of them."""

    type_name: str
    fields: Mapping[str, object]


def build(plain: Plain, make: Callable[..., Any]) -> Any:
    """Turn a plain message into what `make(type_name, **fields)` returns."""
    return make(
        plain.type_name, **{name: _value(value, make) for name, value in plain.fields.items()}
    )


def _value(value: object, make: Callable[..., Any]) -> object:
    if isinstance(value, Plain):
        return build(value, make)
    if isinstance(value, list) and value and isinstance(value[0], Plain):
        return [build(item, make) for item in value]
    return value


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@frozen
class Status:
    """A diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: Level
    message: str
    values: tuple[tuple[str, str], ...] = ()
    hardware_id: str = ""


def time(stamp_ns: int) -> Plain:
    """builtin_interfaces/Time."""
    seconds, rest = divmod(stamp_ns, NANOSECONDS)
    return Plain("builtin_interfaces/msg/Time", {"sec": seconds, "nanosec": rest})


def header(stamp_ns: int, frame_id: str = "") -> Plain:
    """std_msgs/Header."""
    return Plain("std_msgs/msg/Header", {"stamp": time(stamp_ns), "frame_id": frame_id})


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    *,
    position: Iterable[float] = (),
    velocity: Iterable[float] = (),
    effort: Iterable[float] = (),
) -> Plain:
    """sensor_msgs/JointState [rad, rad/s, N m]; effort [A] for robots that publish currents so,
    [V] of drivers."""
    return Plain(
        JOINT_STATE,
        {
            "header": header(stamp_ns),
            "name": list(names),
            "position": list(position),
            "velocity": list(velocity),
            "effort": list(effort),
        },
    )


def battery_state(stamp_ns: int, voltage: float, current: float, location: str = "") -> Plain:
    """sensor_msgs/BatteryState [V, A]: the current is negative while it draws power."""
    # NaN is what the message asks for where a supply is no battery.
    unknown = ("temperature", "charge", "capacity", "design_capacity", "percentage")
    return Plain(
        BATTERY,
        {
            "header": header(stamp_ns),
            "voltage": voltage,
            "current": current,
            **dict.fromkeys(unknown, _NAN),
            "present": True,
            "location": location,
        },
    )


def diagnostics(stamp_ns: int, statuses: Iterable[Status]) -> Plain:
    """diagnostic_msgs/DiagnosticArray."""
    return Plain(
        DIAGNOSTICS, {"header": header(stamp_ns), "status": [_status(item) for item in statuses]}
    )


def _status(status: Status) -> Plain:
    return Plain(
        "diagnostic_msgs/msg/DiagnosticStatus",
        {
            # rclpy wants a level as bytes and does not check: an int goes out as garbage.
            "level": bytes([status.level]),
            "name": status.name,
            "message": status.message,
            "hardware_id": status.hardware_id,
            "values": [
                Plain("diagnostic_msgs/msg/KeyValue", {"key": key, "value": value})
                for key, value in status.values
            ],
        },
    )
