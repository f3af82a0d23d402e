"""Node `tomr_demo`: drives the robot, brings the faults, records what it hears.

Time is that of the simulation, from /clock.
"""

import struct
import time
from collections.abc import Callable, Mapping
from typing import Any

import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from tomr_demo.acts import twist_at
from tomr_demo.topics import Topic
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.nodes.leaving import leave
from tomr_power_model.nodes.stage_node import message_class, to_ros
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot.parameters import Value
from tomr_sim_bridge.plant.samples import command_sample

COMMAND_PERIOD = 0.05  # s
QUEUE = 1000  # of messages, so that drawing a table loses none
SPIN = 0.02  # s

# Gets the topic's full name, the decoded message and its stamp [ns].
Take = Callable[[str, Any, int], None]


# Every message here begins with a header: after the four bytes that state the encoding, which is
# little endian on every machine this runs on, its stamp.
_STAMP = struct.Struct("<4xiI")


def stamp_in(data: bytes) -> int:
    """Stamp [ns] of a serialised message that begins with a header."""
    seconds, rest = _STAMP.unpack_from(data)
    return int(seconds) * NANOSECONDS + int(rest)


class Director(Node):
    """The demo's own node."""

    def __init__(self, topics: Mapping[str, Topic], take: Take) -> None:
        """Listen to `topics`; those marked `decoded` are handed to `take`."""
        super().__init__("tomr_demo", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self.heard: dict[str, int] = dict.fromkeys(topics, 0)
        self.recording: RecordingWriter | None = None
        self._recorded_ns = 0
        self._drive_since: int | None = None
        self._take = take
        self._store = jazzy_typestore()
        self._cmd_vel = self.create_publisher(TwistStamped, "cmd_vel", 10)
        for name, topic in topics.items():
            self._listen(name, topic)
        self._bridge = AsyncParameterClient(self, "sim_bridge")
        self.create_timer(COMMAND_PERIOD, self._command)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    @property
    def now_ns(self) -> int:
        """Time of the simulation [ns], 0 before its first /clock."""
        return int(self.get_clock().now().nanoseconds)

    @property
    def is_bridge_ready(self) -> bool:
        """Whether faults can be switched."""
        return bool(self._bridge.services_are_ready())

    def drive(self) -> None:
        """Drive from now on."""
        self._drive_since = self.now_ns

    def halt(self) -> None:
        """Command standstill from now on."""
        self._drive_since = None

    def spin(self, seconds: float = SPIN) -> None:
        """Serve messages for a time of this computer's clock [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            # Another timeout than the last would make the executor drop what else was ready, and
            # subscriptions would starve the parameter service.
            self._executor.spin_once(timeout_sec=SPIN)

    def request(self, values: Mapping[str, Value]) -> Any:
        """Ask sim_bridge to set parameters, all or none; returns the future answer."""
        wanted = [Parameter(name, value=value) for name, value in values.items()]
        return self._bridge.set_parameters_atomically(wanted)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        leave(self)

    def _listen(self, name: str, topic: Topic) -> None:
        reliability = (
            ReliabilityPolicy.BEST_EFFORT if topic.best_effort else ReliabilityPolicy.RELIABLE
        )

        def receive(data: bytes) -> None:
            self.heard[name] += 1
            stamp = stamp_in(data)
            if self.recording is not None:
                # The newest stamp heard: in order, and no message is received before its time.
                self._recorded_ns = max(self._recorded_ns, stamp)
                self.recording.write_raw(name, topic.type_name, data, self._recorded_ns)
            if topic.decoded:
                self._take(name, self._store.deserialize_cdr(data, topic.type_name), stamp)

        qos = QoSProfile(depth=QUEUE, reliability=reliability)
        self.create_subscription(message_class(topic.type_name), name, receive, qos, raw=True)

    def _command(self) -> None:
        now = self.now_ns
        if not now:
            return
        since = self._drive_since
        twist = (0.0, 0.0, 0.0) if since is None else twist_at((now - since) / NANOSECONDS)
        self._cmd_vel.publish(to_ros(command_sample(now, *twist).message))


def begin_ros() -> None:
    """Join ROS without its signal handlers: the demo has its own."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)


def end_ros() -> None:
    """Leave ROS."""
    rclpy.try_shutdown()
