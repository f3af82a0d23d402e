"""What the nodes of the suite share: parameters, inputs, complaints, a clean end."""

import gc
import signal
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import rclpy
from attrs import evolve
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions

from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_OK
from tomr_power_model.errors import InputError, one_line
from tomr_power_model.messages.outgoing import TYPES, DiagnosticMessage, Outgoing
from tomr_power_model.messages.plain import Plain, build
from tomr_power_model.nodes.command_type import CommandType
from tomr_power_model.nodes.leaving import leave
from tomr_power_model.nodes.reliability import subscription_qos
from tomr_power_model.nodes.robot_parameters import declare_robot, declare_specs
from tomr_power_model.robot import Robot
from tomr_power_model.robot.parameters import NAMELESS, ParameterSpec, Value
from tomr_power_model.topics.flow import Flow
from tomr_power_model.topics.inputs import Complaints, Input

# Sensors are best effort: a late sample is worth less than the next one. The depth bridges the
# moments in which a small computer does something else.
SENSOR_QOS = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
STAGE_QOS = QoSProfile(depth=500, reliability=ReliabilityPolicy.RELIABLE)

HEARD = "has heard every topic that it listens to"

_SIGNAL_CHECK_S = 0.2  # the longest that a signal waits while no message comes
_SILENT_S, _SAY_S = 3.0, 1.0  # without a decision, until it is said, and how often

_RIVALS_S, _RIVALS_SEEN = 5.0, 6  # how often it looks for other nodes, until it says so
_RIVAL = "is this robot diagnosed twice? End one of the two, or give it a namespace of its own"


@cache
def message_class(type_name: str) -> Any:
    """The Python class of a message type such as sensor_msgs/msg/JointState.

    The name may come from a recording: what is no package of messages is not imported. Raises
    ImportError, AttributeError or ValueError.
    """
    package, kind, name = type_name.split("/")
    found = find_spec(package) if package.isidentifier() else None
    folders = (found.submodule_search_locations or ()) if found else ()
    if kind != "msg" or not any(Path(folder, kind).is_dir() for folder in folders):
        raise ImportError(f"no messages of {package!r} are installed")
    return getattr(import_module(f"{package}.{kind}"), name)


def to_ros(plain: Plain) -> Any:
    """A plain message in the form that rclpy takes."""
    return build(plain, lambda type_name, **fields: message_class(type_name)(**fields))


class StageNode(Node):
    """A node around a streaming core: it passes messages in and publishes what comes out."""

    def __init__(
        self,
        name: str,
        specs: Iterable[ParameterSpec],
        fallback: Mapping[str, object] | None = None,
    ) -> None:
        """`fallback`: values of parameters that are not given to the node."""
        super().__init__(name, automatically_declare_parameters_from_overrides=True)
        self.values: dict[str, Value] = declare_specs(self, specs, fallback)
        self._robot = declare_robot(self)
        self._namespace = self.get_namespace().strip("/")
        if self.values.get("hardware_id") == "":
            self.values["hardware_id"] = self._namespace or NAMELESS
        self._complaints = Complaints()
        self._outlets: dict[str, Any] = {}
        self._ends: list[Callable[[], object]] = []  # of what it listens to
        self._topics: dict[str, list[str]] = {"listens to": [], "publishes": []}
        self._unheard: set[str] = set()  # topics it listens to, until the first message
        self._rivals: dict[str, int] = {}  # how often they were seen in a row
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_RIVALS_S, self.look_for_rivals, clock=steady)

    def look_for_rivals(self) -> None:
        """Warn of a second node that diagnoses the same robot: what both say interleaves.

        Only of one that stays: a node that was killed is in the graph for up to 20 s.
        """
        own = self.get_name(), self.get_namespace()
        found = {}
        if self.get_node_names_and_namespaces().count(own) > 1:
            found[own[0]] = "another node of this name runs"
        for topic in self._outlets:
            # Robots share /diagnostics.
            if not topic.startswith("/") and self.count_publishers(topic) > 1:
                found[topic] = "another node publishes it too"
        self._rivals = {name: self._rivals.get(name, 0) + 1 for name in found}
        lasting = [name for name in found if self._rivals[name] >= _RIVALS_SEEN]
        for name in lasting[:1]:  # one line says it
            self.complain(name, f"{found[name]}: {_RIVAL}")

    def listen(
        self, inputs: Iterable[Input], advance: Callable[[], None], qos: QoSProfile = SENSOR_QOS
    ) -> None:
        """Subscribe; after each message `advance` takes out of the core what is due."""
        for item in inputs:
            self._subscribe(item, advance, qos)

    def _subscribe(self, item: Input, advance: Callable[[], None], qos: QoSProfile) -> None:
        clock, qos = self.get_clock(), subscription_qos(self, item.topic, qos)
        self._note("listens to", item.topic, item.type_name)
        if not item.is_optional:
            self._unheard.add(item.topic)

        def subscribe(type_name: str) -> Any:
            kind = message_class(type_name)
            flow = Flow(has_header="header" in kind.get_fields_and_field_types())

            def receive(data: bytes) -> None:
                now = clock.now().nanoseconds
                if self._unheard:
                    self._hear(item.topic)
                if item.is_too_close is not None and item.is_too_close(flow.stamp_of(data)):
                    return
                problem = flow.refuses(data, now)
                if problem is None:
                    problem = item.take(deserialize_message(data, kind), now)
                if problem is not None:
                    self.complain(item.topic, problem)
                advance()

            return self.create_subscription(
                kind,
                item.topic,
                receive,
                qos,
                raw=True,  # what is too much is not even decoded
                # Each default event adds to every wait: together a sixth of the nodes' CPU.
                event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            )

        if item.other_types:
            setting = str(self.values["cmd_vel_type"])
            self._ends.append(CommandType(self, item.topic, setting, subscribe).close)
        else:
            subscription = subscribe(item.type_name)
            self._ends.append(lambda: self.destroy_subscription(subscription))

    def _hear(self, topic: str) -> None:
        """Note the first message of a topic; whoever waits for the node learns when all came."""
        self._unheard.discard(topic)
        if not self._unheard:
            self.get_logger().info(HEARD)

    def watch_silence(self, say: Callable[[int], None]) -> None:
        """Have `say` called, with the time [ns], for as long as nothing can be decided of what
        comes; by the computer's clock, since that of a robot which is off stands still."""
        self.heard_now()

        def look() -> None:
            if time.monotonic() - self._heard_at > _SILENT_S:
                say(self.get_clock().now().nanoseconds)

        timer = self.create_timer(_SAY_S, look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._ends.append(lambda: self.destroy_timer(timer))

    def heard_now(self) -> None:
        """Note that something was decided just now."""
        self._heard_at = time.monotonic()

    def unlisten(self) -> None:
        """Take back all subscriptions, and stop watching for silence."""
        self._unheard.clear()
        for end in self._ends:
            end()
        self._ends.clear()
        self._topics["listens to"].clear()

    def _note(self, what: str, topic: str, type_name: str) -> None:
        kind = type_name.rpartition("/")[2]
        self._topics[what].append(f"{self.resolve_topic_name(topic)} ({kind})")

    def introduce(self) -> None:
        """Log robot, topics and types, once."""
        self.get_logger().info(described(self._robot))
        for what, topics in self._topics.items():
            if topics:
                self.get_logger().info(f"{what} {', '.join(topics)}")

    def on_change(self, apply: Callable[[dict[str, Value]], None]) -> None:
        """Apply all values anew when some of them are set while the node runs."""

        def set_(parameters: list[Parameter]) -> None:
            for parameter in parameters:
                if parameter.name in self.values:
                    self.values[parameter.name] = parameter.value
            apply(self.values)

        self.add_post_set_parameters_callback(set_)

    def complain(self, topic: str, problem: str) -> None:
        """Warn of a message, the first time and then ever more rarely."""
        line = self._complaints.note(topic, problem)
        if line is not None:
            self.get_logger().warning(line)

    def offer(self, topic: str, kind: type[Outgoing]) -> None:
        """Prepare a topic to publish on."""
        self.offer_type(topic, TYPES[kind])

    def offer_type(self, topic: str, type_name: str) -> None:
        """Prepare a topic to publish messages of a type on."""
        self._note("publishes", topic, type_name)
        self._outlets[topic] = self.create_publisher(
            message_class(type_name),
            topic,
            STAGE_QOS,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def withdraw(self) -> None:
        """Take back all that was offered."""
        for outlet in self._outlets.values():
            self.destroy_publisher(outlet)
        self._outlets.clear()
        self._topics["publishes"].clear()

    def send(self, message: Outgoing) -> None:
        """Publish a record on its topic, if anybody listens."""
        if not self.is_heard(message.topic):
            return
        if self._namespace and isinstance(message, DiagnosticMessage):
            message = _of_robot(message, self._namespace)
        self.publish(message.topic, message.plain)

    def publish(self, topic: str, message: Plain) -> None:
        """Publish a plain message on a topic that was offered."""
        self._outlets[topic].publish(to_ros(message))

    def is_heard(self, topic: str) -> bool:
        """Whether a topic is offered and anybody listens to it."""
        outlet = self._outlets.get(topic)
        return outlet is not None and outlet.get_subscription_count() > 0


def _of_robot(message: DiagnosticMessage, namespace: str) -> DiagnosticMessage:
    """Robots share /diagnostics: there the names of statuses begin with their namespaces."""
    if not message.topic.startswith("/"):
        return message
    named = [evolve(status, name=f"/{namespace}/{status.name}") for status in message.statuses]
    return evolve(message, statuses=tuple(named))


def described(robot: Robot) -> str:
    """A robot in a line."""
    return (
        f"robot of {robot.mass:g} kg on wheels of {robot.wheel_radius:g} m at "
        f"{robot.robot_radius:g} m: {', '.join(robot.wheel_names)}"
    )


class StopRequest:
    """Set by SIGINT or SIGTERM. rclpy's own handlers can lose a signal that comes early. What comes
    after the first is ignored: a signal to the process group comes twice, and the second would
    interrupt the clean-up, or meet an interpreter that has put its handlers away."""

    _NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self.is_set = False
        for number in self._NUMBERS:
            signal.signal(number, self._set)

    def _set(self, *_: object) -> None:
        self.is_set = True
        for number in self._NUMBERS:
            signal.signal(number, signal.SIG_IGN)


def make_executor() -> Executor:
    """The executor that costs least: waiting for a set of entities takes more than half of the
    nodes' CPU, which events do without."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:  # rclpy before 7.1.5
        return SingleThreadedExecutor()
    return EventsExecutor()


def run_node(make: Callable[[], Node], arguments: list[str] | None = None) -> int:
    """Make a node and spin it until a signal; bad parameters end it with one line and code 2.

    Raises what a node keeps as its `failure`: an executor prints a trace of what callbacks raise.
    """
    stop = StopRequest()
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
    except InputError as error:
        print(one_line(f"error: {error}"), file=sys.stderr)
        rclpy.try_shutdown()
        return EXIT_BAD_INPUT
    except RCLError as error:
        # A parameter file that rcl cannot read; its text ends with where it was in C.
        reason = str(error).partition(", at ")[0]
        print(one_line(f"error: {reason}: mend the file"), file=sys.stderr)
        return EXIT_BAD_INPUT
    if isinstance(node, StageNode):
        node.introduce()
    executor = make_executor()
    executor.add_node(node)
    # What start-up left lives as long as the node: the collector need not walk it again and again.
    gc.collect()
    gc.freeze()
    failure: InputError | None = None
    while not stop.is_set and failure is None:
        executor.spin_once(_SIGNAL_CHECK_S)
        failure = getattr(node, "failure", None)
    executor.shutdown()
    leave(node, EXIT_OK if failure is None else EXIT_BAD_INPUT)
    rclpy.try_shutdown()
    if failure is not None:
        raise failure
    return EXIT_OK
