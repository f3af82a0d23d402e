"""The suite's messages in the form that rclpy takes."""

from functools import singledispatch
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import BatteryState, JointState
from std_msgs.msg import Header

from tomr_power_model.messages.outgoing import (
    DiagnosticMessage,
    JointMessage,
    Outgoing,
    Status,
    SupplyMessage,
)
from tomr_power_model.messages.readings import BATTERY_UNKNOWNS
from tomr_power_model.model.ticks import NANOSECONDS

# rclpy wants a level as bytes and does not check: an int goes out as garbage.
_LEVELS = tuple(bytes([level]) for level in range(4))


def ros_header(stamp_ns: int) -> Header:
    """A header with a stamp [ns]."""
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds))


@singledispatch
def to_ros(message: Outgoing) -> Any:
    """The ROS message of a record."""
    raise TypeError(f"{type(message).__name__} is no message of this suite")


@to_ros.register
def _(message: SupplyMessage) -> BatteryState:
    return BatteryState(
        header=ros_header(message.stamp_ns),
        voltage=float(message.reading.voltage),
        current=float(message.reading.current),
        present=True,
        **BATTERY_UNKNOWNS,
    )


@to_ros.register
def _(message: JointMessage) -> JointState:
    return JointState(
        header=ros_header(message.stamp_ns),
        name=list(message.names),
        velocity=list(message.velocity),
        effort=list(message.effort),
    )


@to_ros.register
def _(message: DiagnosticMessage) -> DiagnosticArray:
    return DiagnosticArray(
        header=ros_header(message.stamp_ns), status=[_status(s) for s in message.statuses]
    )


def _status(status: Status) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=_LEVELS[status.level],
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=[KeyValue(key=key, value=value) for key, value in status.values],
    )
