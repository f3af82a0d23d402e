"""What the nodes of the suite share: parameters, inputs, complaints, a clean end."""

import signal
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_OK
from tomr_power_model.errors import InputError
from tomr_power_model.messages.outgoing import TYPES, Outgoing
from tomr_power_model.messages.plain import Plain, build
from tomr_power_model.messages.types import TWIST, TWIST_STAMPED
from tomr_power_model.nodes.robot_parameters import declare_robot, declare_specs
from tomr_power_model.robot.parameters import ParameterSpec, Value
from tomr_power_model.topics.inputs import Complaints, Input

# Sensors are best effort: a late sample is worth less than the next one. The depth bridges the
# moments in which a small computer does something else.
SENSOR_QOS = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
STAGE_QOS = QoSProfile(depth=500, reliability=ReliabilityPolicy.RELIABLE)

_SIGNAL_CHECK_S = 0.2  # the longest that a signal waits while no message comes

CMD_VEL_TYPE = ParameterSpec(
    "cmd_vel_type",
    "message type of cmd_vel; a Twist counts from when it arrives",
    "str",
    "twist_stamped",
    choices=("twist_stamped", "twist"),
)
TWIST_TYPES = {"twist_stamped": TWIST_STAMPED, "twist": TWIST}


@cache
def message_class(type_name: str) -> Any:
    """The Python class of a message type such as sensor_msgs/msg/JointState."""
    package, _, name = type_name.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def to_ros(plain: Plain) -> Any:
    """A plain message in the form that rclpy takes."""
    return build(plain, lambda type_name, **fields: message_class(type_name)(**fields))


class StageNode(Node):
    """A node around a streaming core: it passes messages in and publishes what comes out."""

    def __init__(self, name: str, specs: Iterable[ParameterSpec]) -> None:
        super().__init__(name, automatically_declare_parameters_from_overrides=True)
        self.values: dict[str, Value] = declare_specs(self, specs)
        self._robot = declare_robot(self)
        self._complaints = Complaints()
        self._outlets: dict[str, Any] = {}

    def listen(
        self, inputs: Iterable[Input], advance: Callable[[], None], qos: QoSProfile = SENSOR_QOS
    ) -> None:
        """Subscribe; after each message `advance` takes out of the core what is due."""
        for item in inputs:
            self._subscribe(item, advance, qos)

    def _subscribe(self, item: Input, advance: Callable[[], None], qos: QoSProfile) -> None:
        clock = self.get_clock()

        def receive(message: Any) -> None:
            problem = item.take(message, clock.now().nanoseconds)
            if problem is not None:
                self.complain(item.topic, problem)
            advance()

        self.create_subscription(
            message_class(item.type_name),
            item.topic,
            receive,
            qos,
            # Each default event adds to every wait: together a sixth of the nodes' CPU.
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

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
        self._outlets[topic] = self.create_publisher(
            message_class(type_name),
            topic,
            STAGE_QOS,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def send(self, message: Outgoing) -> None:
        """Publish a record on its topic."""
        self.publish(message.topic, message.plain)

    def publish(self, topic: str, message: Plain) -> None:
        """Publish a plain message on a topic that was offered."""
        self._outlets[topic].publish(to_ros(message))


class StopRequest:
    """Set by SIGINT or SIGTERM. rclpy's own handlers can lose a signal that comes early, and a
    signal to the process group comes twice and would interrupt the clean-up."""

    def __init__(self) -> None:
        self.is_set = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._set)

    def _set(self, *_: object) -> None:
        self.is_set = True


def run_node(make: Callable[[], Node], arguments: list[str] | None = None) -> int:
    """Make a node and spin it until a signal; bad parameters end it with one line and code 2."""
    stop = StopRequest()
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        rclpy.try_shutdown()
        return EXIT_BAD_INPUT
    except RCLError as error:
        # A parameter file that rcl cannot read; its text ends with where it was in C.
        print(f"error: {str(error).partition(', at ')[0]}: mend the file", file=sys.stderr)
        return EXIT_BAD_INPUT
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not stop.is_set:
        executor.spin_once(_SIGNAL_CHECK_S)
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return EXIT_OK
