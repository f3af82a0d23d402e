"""Messages that the suite publishes, as records."""

from attrs import frozen

from tomr_power_model.messages.plain import (
    Plain,
    Status,
    battery_state,
    diagnostics,
    joint_state,
)
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.messages.types import BATTERY, DIAGNOSTICS, JOINT_STATE


@frozen
class SupplyMessage:
    """A sensor_msgs/BatteryState."""

    topic: str
    stamp_ns: int
    reading: SupplyReading

    @property
    def plain(self) -> Plain:
        return battery_state(self.stamp_ns, self.reading.voltage, self.reading.current)


@frozen
class JointMessage:
    """A sensor_msgs/JointState without positions, and of some topics without speeds."""

    topic: str
    stamp_ns: int
    names: tuple[str, ...]
    velocity: tuple[float, ...]  # rad/s
    effort: tuple[float, ...]  # N m, or V of the motors' drivers

    @property
    def plain(self) -> Plain:
        return joint_state(self.stamp_ns, self.names, velocity=self.velocity, effort=self.effort)


@frozen
class DiagnosticMessage:
    """A diagnostic_msgs/DiagnosticArray."""

    topic: str
    stamp_ns: int
    statuses: tuple[Status, ...]

    @property
    def plain(self) -> Plain:
        return diagnostics(self.stamp_ns, self.statuses)


Outgoing = SupplyMessage | JointMessage | DiagnosticMessage

TYPES: dict[type[Outgoing], str] = {
    SupplyMessage: BATTERY,
    JointMessage: JOINT_STATE,
    DiagnosticMessage: DIAGNOSTICS,
}
