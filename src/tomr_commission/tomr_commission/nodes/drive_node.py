"""Node `tomr_commission_drive`: drives the robot through cmd_vel and records what it answers."""

import signal
import time
from pathlib import Path
from typing import Any, Self

import rclpy
from attrs import field, frozen
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions

from tomr_commission.driving import STILL, Command, DriveChoice, DriveWatch
from tomr_power_model.drive.sources import VOLTAGE_TOPIC
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.messages.types import IMU, MULTI_ARRAY, ODOMETRY, TWIST, TWIST_TYPES
from tomr_power_model.nodes.command_type import chosen_type
from tomr_power_model.nodes.leaving import leave
from tomr_power_model.nodes.stage_node import SENSOR_QOS, make_executor, message_class, to_ros
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Input, measured_inputs
from tomr_reality_gap.progress import Progress
from tomr_sim_bridge.missions.schema import Twist
from tomr_sim_bridge.plant.samples import command_sample

NAME = "tomr_commission_drive"
_COMMAND = "cmd_vel"
_WAIT = 10.0  # s for the first sample of the encoders
_NAMELESS = "_NODE_NAME_UNKNOWN_"  # rmw's word, until a node's name has come after its publisher
_SETTLE = 1.0  # s in which the graph shows who else is there
_SPIN = 0.01  # s
_BACK, _ON = -0.2, 2.0  # s that a clock may go between two looks
_HALT = 0.5  # s of standing commanded at the end, whatever ended it
# Recorded where they are published.
_BESIDE = (("imu/data", IMU), ("odom", ODOMETRY), (VOLTAGE_TOPIC, MULTI_ARRAY))


@frozen
class DriveRequest:
    """Whom to drive how."""

    robot: Robot
    commands: tuple[Command, ...]
    slow_end: float  # s
    command_type: str = "auto"  # of TWIST_TYPES
    namespace: str = ""
    sim_time: bool = False
    choice: DriveChoice = field(factory=DriveChoice)


class DriveNode(Node):
    """Commands, listens and records."""

    def __init__(self, request: DriveRequest) -> None:
        super().__init__(
            NAME,
            namespace=request.namespace,
            parameter_overrides=[Parameter("use_sim_time", value=request.sim_time)],
        )
        self._request = request
        self._writer: RecordingWriter | None = None
        self._commanded = 0  # ns, the last time
        self._stamp = 0  # of the newest message recorded: they are in order
        self._type = TWIST_TYPES[request.command_type]
        self._outlet: Any = None
        self._start_ns = 0
        self.watch = DriveWatch(request.robot, request.choice)
        self.heard = 0
        self._last = time.monotonic()
        inputs = measured_inputs(request.robot, self._encoders, lambda reading: "")
        for item in inputs:
            self._listen(item.topic, item.type_name, item)
        for topic, type_name in _BESIDE:
            self._listen(topic, type_name)
        self._executor = make_executor()
        self._executor.add_node(self)

    @property
    def seconds(self) -> float:
        """Since the drive began."""
        return (self.get_clock().now().nanoseconds - self._start_ns) / NANOSECONDS

    @property
    def silent(self) -> float:
        """Since the last sample of the encoders [s], by this computer's clock."""
        return time.monotonic() - self._last

    @property
    def lacks(self) -> str:
        """What must come before anything can begin, and what to see to; empty: all is there."""
        if not self.heard:
            return (
                "joint_states: nothing so far: start the robot's stack, and give --namespace and "
                "ROS_DOMAIN_ID as it has them"
            )
        if not self.get_clock().now().nanoseconds:
            return "/clock: nothing so far: publish it, or leave --sim-time out"
        return ""

    def begin(self, writer: RecordingWriter) -> None:
        """Record from now on."""
        self._writer = writer
        self._last = time.monotonic()
        self._start_ns = self.get_clock().now().nanoseconds

    def take_over(self) -> None:
        """Be who commands, with the type that is listened to."""
        if self._request.command_type == "auto":
            listeners = self.get_subscriptions_info_by_topic(_COMMAND)
            self._type = chosen_type(self._type, {info.topic_type for info in listeners})
        self._outlet = self.create_publisher(message_class(self._type), _COMMAND, 10)

    @property
    def rivals(self) -> str:
        """Who else commands, and what to do; empty: nobody."""
        infos = self.get_publishers_info_by_topic(_COMMAND)
        names = [
            "a node without a name"
            if info.node_name == _NAMELESS
            else f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in infos
        ]
        own = self.get_fully_qualified_name()
        if self._outlet is not None and own in names:
            names.remove(own)  # once: another may drive with the same command
        if not names:
            return ""
        return (
            f"cmd_vel is published by {', '.join(sorted(set(names)))}: stop that, two cannot drive"
        )

    def spin(self, seconds: float = _SPIN) -> None:
        """Take what comes, for a time of this computer's clock [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=_SPIN)

    def command(self, twist: Twist) -> None:
        """Send a command, and record it."""
        now = self.get_clock().now().nanoseconds
        message = to_ros(command_sample(now, *twist).message)
        if self._type == TWIST:
            message = message.twist
        self._outlet.publish(message)
        self.watch.command(self.seconds, twist)
        if now > self._commanded:  # a simulation's time may stand
            self._record(_COMMAND, self._type, serialize_message(message), now)
        self._commanded = now

    def halt(self) -> None:
        """Command standing for a moment."""
        end = time.monotonic() + _HALT
        while time.monotonic() < end:
            self.command(STILL)
            self.spin(0.05)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        leave(self)

    def _encoders(
        self, stamp_ns: int, position: tuple[float, ...], velocity: tuple[float, ...]
    ) -> str:
        self.heard += 1
        self._last = time.monotonic()
        if self._start_ns:
            (a, b, c), (d, e, f) = position, velocity
            now = self.seconds
            stamp = stamp_ns / NANOSECONDS if stamp_ns else now
            self.watch.encoders(now, stamp, (a, b, c), (d, e, f))
        return ""

    def _listen(self, topic: str, type_name: str, item: Input | None = None) -> None:
        kind = message_class(type_name)

        def receive(data: bytes) -> None:
            now = self.get_clock().now().nanoseconds
            self._record(topic, type_name, data, now)
            if item is not None:
                problem = item.take(deserialize_message(data, kind), now)
                if problem:
                    self.get_logger().warning(f"{topic}: {problem}", throttle_duration_sec=5.0)

        self.create_subscription(kind, topic, receive, SENSOR_QOS, raw=True)

    def _record(self, topic: str, type_name: str, data: bytes, stamp_ns: int) -> None:
        if self._writer is not None:
            self._stamp = max(self._stamp, stamp_ns)
            self._writer.write_raw(topic, type_name, data, self._stamp)


def drive(request: DriveRequest, out: Path, progress: Progress) -> None:
    """Drive and record to a new folder; the robot is commanded to stand whatever ends it.

    Raises:
        InputError: nobody is there, somebody else commands, or the robot does not as commanded.
        KeyboardInterrupt: after a signal.
    """
    with _Signals() as signals:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        try:
            node = DriveNode(request)
            try:
                _wait_for(node, signals)
                if node.rivals:
                    raise InputError(node.rivals)
                node.take_over()
                with RecordingWriter(out) as writer:
                    node.begin(writer)
                    try:
                        _follow(node, request, signals, progress)
                    finally:
                        node.halt()
            finally:
                node.close()
        finally:
            rclpy.try_shutdown()


class _Signals:
    """Holds SIGINT and SIGTERM back until the robot stands. An executor would print what they
    raise in a callback, and a second one would leave the robot driving."""

    def __enter__(self) -> Self:
        self._noted: list[int] = []
        self._before = {
            number: signal.signal(number, lambda number, _: self._noted.append(number))
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        return self

    def __exit__(self, *_: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        if self._noted:
            signal.raise_signal(self._noted[0])

    def check(self) -> None:
        """Raise KeyboardInterrupt after a signal."""
        if self._noted:
            raise KeyboardInterrupt


def _wait_for(node: DriveNode, signals: _Signals) -> None:
    end = time.monotonic() + _WAIT
    node.spin(_SETTLE)
    while node.lacks:
        if time.monotonic() > end:
            raise InputError(node.lacks)
        signals.check()
        node.spin()


def _follow(node: DriveNode, request: DriveRequest, signals: _Signals, progress: Progress) -> None:
    length, is_slow = request.commands[-1].time, True
    waiting = list(reversed(request.commands))
    before = 0.0
    while waiting:
        signals.check()
        node.spin()
        now = node.seconds
        if not _BACK < now - before < _ON:
            raise InputError(f"stopped: the clock leaps by {now - before:.1f} s: see to it")
        before = now
        if now >= waiting[-1].time:
            due = waiting.pop()
            while waiting and now >= waiting[-1].time:
                due = waiting.pop()
            node.command(due.twist)
        problem = node.watch.problem(now, node.silent)
        if not problem and node.rivals:
            first = node.rivals
            node.halt()  # first of all; meanwhile a node that just came shows its name
            problem = node.rivals or first
        if is_slow and now >= request.slow_end:
            is_slow = False
            problem = problem or _answers(node.watch)
        if problem:
            raise InputError(f"stopped after {now:.1f} s: {problem}")
        progress("slowly" if is_slow else "as planned", min(now / length, 1.0))


def _answers(watch: DriveWatch) -> str:
    wrong = list(watch.mistakes())
    if not wrong:
        return ""
    return (
        f"{'; '.join(wrong)}: see to robot.wheel_names, wheel_offset, wheel_radius, robot_radius "
        "and the signs in the driver"
    )
