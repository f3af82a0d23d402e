"""Plays a drive in real time out of memory."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

import rclpy
from drive import Raw
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from tomr_power_model.errors import InputError
from tomr_power_model.nodes.stage_node import STAGE_QOS, message_class

_CONNECT_TIMEOUT_S = 20.0
_POLL_S = 0.02


class Feeder:
    """Publishers of the topics to play."""

    def __init__(self, node: Node, messages: Iterable[Raw]) -> None:
        self._node = node
        types = {message.topic: message.type_name for message in messages}
        self._outlets = {
            topic: node.create_publisher(message_class(name), topic.lstrip("/"), STAGE_QOS)
            for topic, name in types.items()
        }

    def wait_for(self, listeners: dict[str, int], alive: Callable[[], bool]) -> None:
        """Wait until each topic has so many subscribers, and a publisher."""
        deadline = time.monotonic() + _CONNECT_TIMEOUT_S
        missing = dict(listeners)
        while missing and alive() and time.monotonic() < deadline:
            time.sleep(_POLL_S)
            missing = {t: n for t, n in missing.items() if not self._is_connected(t, n)}
        if missing and alive():
            raise InputError(
                f"not connected after {_CONNECT_TIMEOUT_S:g} s: {', '.join(missing)}; does "
                "something else use this ROS_DOMAIN_ID?"
            )

    def _is_connected(self, topic: str, count: int) -> bool:
        name = topic.lstrip("/")
        outlet = self._outlets.get(topic)
        matched = outlet is None or outlet.get_subscription_count() == count
        heard = self._node.count_subscribers(name) == count
        publishers = self._node.count_publishers(name)
        # All nodes say on /diagnostics how their inputs do; what is played here comes from here.
        return matched and heard and (publishers == 1 if outlet else publishers > 0)

    def play(self, timed: Sequence[tuple[int, Raw]], start_ns: int) -> list[int]:
        """Publish each message at start_ns plus its offset on the monotonic clock [ns].

        Returns when each was handed over.
        """
        handed = []
        for offset, message in timed:
            left = start_ns + offset - time.monotonic_ns()
            if left > 0:
                time.sleep(1e-9 * left)
            handed.append(time.monotonic_ns())
            self._outlets[message.topic].publish(message.data)
        return handed


@contextmanager
def feeder(messages: Iterable[Raw]) -> Iterator[Feeder]:
    """A feeder for the topics of the messages."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("feeder")
    try:
        yield Feeder(node, messages)
    finally:
        node.destroy_node()
        rclpy.shutdown()
