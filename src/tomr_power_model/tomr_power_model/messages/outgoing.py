"""Messages that the suite publishes, as plain records: one form for ROS, another for recordings."""

from enum import IntEnum

from attrs import frozen

from tomr_power_model.messages.readings import SupplyReading


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@frozen
class SupplyMessage:
    """A sensor_msgs/BatteryState."""

    topic: str
    stamp_ns: int
    reading: SupplyReading


@frozen
class JointMessage:
    """A sensor_msgs/JointState without positions."""

    topic: str
    stamp_ns: int
    names: tuple[str, ...]
    velocity: tuple[float, ...]  # rad/s
    effort: tuple[float, ...]  # N m


@frozen
class Status:
    """A diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: Level
    message: str
    values: tuple[tuple[str, str], ...] = ()
    hardware_id: str = ""


@frozen
class DiagnosticMessage:
    """A diagnostic_msgs/DiagnosticArray."""

    topic: str
    stamp_ns: int
    statuses: tuple[Status, ...]


Outgoing = SupplyMessage | JointMessage | DiagnosticMessage

TYPES: dict[type[Outgoing], str] = {
    SupplyMessage: "sensor_msgs/msg/BatteryState",
    JointMessage: "sensor_msgs/msg/JointState",
    DiagnosticMessage: "diagnostic_msgs/msg/DiagnosticArray",
}
