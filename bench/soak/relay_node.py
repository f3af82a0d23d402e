"""Between the simulator and the diagnosis: what passes, when, with which stamps, what is said."""

import struct
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import BatteryState, JointState

from soak.acts import BATTERY, COMMANDS, ENCODERS, POWER, SIMULATOR, SUITES
from tomr_demo.acts import twist_at
from tomr_fault_diag.classifier.messages import NAME
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.nodes.stage_node import SENSOR_QOS, STAGE_QOS, make_executor
from tomr_power_model.recordings import RecordingWriter

PLANT = "plant"  # namespace of the simulator
COMMAND_PERIOD_NS = NANOSECONDS // 20
# Commands are given for a moment that is still to come: however long they are on their way, the
# robot and the model let them act at the same time.
LEAD_NS = NANOSECONDS // 5
_TYPES = {COMMANDS: TwistStamped, ENCODERS: JointState, BATTERY: BatteryState} | dict.fromkeys(
    POWER, BatteryState
)
_KEPT_NS = 30 * NANOSECONDS  # of what was passed on
_STAMP = struct.Struct("<iI")
_HEAD = 4  # of CDR, before the first field
_HELD = "no data at present"


@contextmanager
def connected() -> Iterator[None]:
    """ROS for this process, which handles its signals itself."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


def _stamp_of(data: bytes) -> int:
    seconds, rest = _STAMP.unpack_from(data, _HEAD)
    return int(seconds) * NANOSECONDS + int(rest)


def _stamped(data: bytes, stamp_ns: int) -> bytes:
    changed = bytearray(data)
    _STAMP.pack_into(changed, _HEAD, *divmod(stamp_ns, NANOSECONDS))
    return bytes(changed)


class Relay(Node):
    """Drives the robot, passes its messages on and hears what is said of it.

    Time is that of the simulator: the newest stamp of its encoders.
    """

    def __init__(self, said: Callable[[str, str, bool], None]) -> None:
        """`said(suite, state, usable)` gets each verdict."""
        super().__init__("soak")
        self.now_ns = 0
        self.shift_ns = 0  # of all stamps that are passed on
        self.silent: set[str] = set()  # topics that are not passed on
        self.resting = False
        self.flooded: str | None = None  # suite that gets its encoders elsewhere
        self._said = said
        self._commanded_ns = 0
        self._outlets: dict[tuple[str, str], Any] = {}
        self._passed: deque[tuple[int, str, bytes]] = deque()  # at [ns], topic, message
        self._drive = self.create_publisher(TwistStamped, f"{PLANT}/{COMMANDS}", SENSOR_QOS)
        for topic, kind in _TYPES.items():
            for suite in SUITES:
                name = f"{suite}/{topic}"
                self._outlets[suite, topic] = self.create_publisher(kind, name, SENSOR_QOS)
            if topic != COMMANDS:
                self._hear(topic, kind)
        self.create_subscription(
            DiagnosticArray, "/diagnostics", self._verdict, STAGE_QOS, raw=True
        )
        self._client = AsyncParameterClient(self, f"{PLANT}/{SIMULATOR}")
        self._executor = make_executor()
        self._executor.add_node(self)

    def spin(self) -> None:
        """Take what comes, for some milliseconds."""
        self._executor.spin_once(0.005)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()

    @property
    def is_simulator_ready(self) -> bool:
        """Whether faults can be set."""
        return bool(self._client.services_are_ready())

    def set_fault(self, settings: dict[str, int | float]) -> Any:
        """Ask the simulator for a fault; returns the future answer."""
        wanted = [Parameter(name, value=value) for name, value in settings.items()]
        return self._client.set_parameters_atomically(wanted)

    def write_last(self, path: Path) -> None:
        """Record what was passed on lately, encoders of a flood excepted: to be diagnosed again."""
        with RecordingWriter(path) as writer:
            for now_ns, topic, data in self._passed:
                kind = _TYPES[topic]
                name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
                writer.write_raw(topic, name, data, now_ns)

    def _hear(self, topic: str, kind: Any) -> None:
        def take(data: bytes) -> None:
            stamp = _stamp_of(data)
            if topic == ENCODERS:
                self._moved(stamp)
            self._pass_on(topic, data, stamp)

        self.create_subscription(kind, f"{PLANT}/{topic}", take, SENSOR_QOS, raw=True)

    def _moved(self, stamp: int) -> None:
        self.now_ns = stamp
        if stamp + LEAD_NS - self._commanded_ns >= COMMAND_PERIOD_NS:
            self._command(stamp + LEAD_NS)

    def _command(self, stamp: int) -> None:
        self._commanded_ns = stamp
        message = TwistStamped()
        if not self.resting:
            v_x, v_y, omega_z = twist_at(stamp / NANOSECONDS % 1e5)
            message.twist.linear.x, message.twist.linear.y = v_x, v_y
            message.twist.angular.z = omega_z
        data = _stamped(serialize_message(message), stamp)
        self._drive.publish(data)
        self._pass_on(COMMANDS, data, stamp)

    def _pass_on(self, topic: str, data: bytes, stamp: int) -> None:
        if topic in self.silent:
            return
        if self.shift_ns:
            data = _stamped(data, stamp + self.shift_ns)
        self._passed.append((self.now_ns, topic, data))
        while self.now_ns - self._passed[0][0] > _KEPT_NS:
            self._passed.popleft()
        for suite in SUITES:
            if topic != ENCODERS or suite != self.flooded:
                self._outlets[suite, topic].publish(data)

    def _verdict(self, data: bytes) -> None:
        if NAME.encode() not in data:
            return
        for status in deserialize_message(data, DiagnosticArray).status:
            suite, _, name = status.name.strip("/").partition("/")
            if name == NAME:
                values = {pair.key: pair.value for pair in status.values}
                self._said(suite, values["state"], _HELD not in status.message)
