"""The type of cmd_vel: Twist and TwistStamped are both common, and a topic can have one only."""

from collections.abc import Callable, Collection
from typing import Any

from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from tomr_power_model.messages.types import TWIST_TYPES

_LOOK_PERIOD = 0.5  # s


def chosen_type(current: str, found: Collection[str]) -> str:
    """The type to subscribe with, given the types of the publishers that there are."""
    usable = [name for name in TWIST_TYPES.values() if name in found]
    return current if current in found or not usable else usable[0]


class CommandType:
    """Subscribes to a topic of commands with the type that `cmd_vel_type` names; with the one that
    its publishers have where that is `auto`. Warns of publishers of another type: nobody would
    hear them, and ROS says nothing."""

    def __init__(
        self, node: Node, topic: str, setting: str, subscribe: Callable[[str], Any]
    ) -> None:
        """`subscribe` makes a subscription of a type's name."""
        self._node = node
        self._topic = node.resolve_topic_name(topic)
        self._is_auto = setting == "auto"
        self._type = TWIST_TYPES[setting]
        self._subscribe = subscribe
        self._subscription = subscribe(self._type)
        self._unheard: set[str] = set()
        # Time of a simulation may stand still before its first command.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(_LOOK_PERIOD, self._look, clock=steady)

    def close(self) -> None:
        """Listen no longer."""
        self._node.destroy_timer(self._timer)
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)

    def _look(self) -> None:
        if self._subscription is None:
            try:
                self._subscription = self._subscribe(self._type)
            except RCLError:  # the old one is still there
                return
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        found = {publisher.topic_type for publisher in publishers}
        wanted = chosen_type(self._type, found) if self._is_auto else self._type
        if wanted != self._type:
            # A participant has a topic in one type; the old one is gone at the next look.
            self._node.destroy_subscription(self._subscription)
            self._type, self._subscription = wanted, None
            self._node.get_logger().info(f"{self._topic} is a {wanted}: listening to that")
        unheard = found - {self._type}
        if unheard - self._unheard:
            self._node.get_logger().warning(
                f"{self._topic}: published as {', '.join(sorted(unheard))}, which is not heard: "
                f"this node listens to {self._type}; set cmd_vel_type, or remap one of them"
            )
        self._unheard |= unheard
