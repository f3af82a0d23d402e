"""How a node leaves ROS beside others that leave.

Fast DDS 2.14 waits for ever where a node's participant ends while a peer's end is just being
reported to it: it waits for that report with the lock in hand which the report needs. Nodes that
are asked to end together do that to each other, one of some hundred. So each takes back its topics
first, and ends itself a little later, at a time of its own.
"""

import faulthandler
import os
import time

from rclpy.node import Node

_AFTER_S, _APART_S, _TIMES = 0.1, 0.05, 8  # after the topics, and by how much processes differ
_LONGEST_S = 4.0


def leave(node: Node) -> None:
    """Destroy a node; a process that DDS holds all the same ends with code 1, and says where."""
    faulthandler.dump_traceback_later(_LONGEST_S, exit=True)  # needs no lock of Python's
    for subscription in [*node.subscriptions]:
        node.destroy_subscription(subscription)
    for publisher in [*node.publishers]:
        node.destroy_publisher(publisher)
    for service in [*node.services]:
        node.destroy_service(service)
    time.sleep(_AFTER_S + _APART_S * (os.getpid() % _TIMES))
    node.destroy_node()
    faulthandler.cancel_dump_traceback_later()
