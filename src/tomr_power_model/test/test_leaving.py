"""How a node leaves ROS, and that it does whatever DDS does."""

import sys
from collections.abc import Callable
from typing import Any

import pytest

NODE = """
import ctypes, sys
from rclpy.node import Node
from std_msgs.msg import String
from tomr_power_model.errors import InputError
from tomr_power_model.nodes.stage_node import run_node

class Leaving(Node):
    def __init__(self):
        super().__init__("leaving")
        self.create_publisher(String, "said", 1)
        self.create_subscription(String, "heard", lambda _: None, 1)
        if FAILS:
            self.failure = InputError("it failed")
        print("is up", flush=True)

    def destroy_node(self):
        mine = {"said", "heard"}
        names = {one.topic_name.strip("/") for one in (*self.publishers, *self.subscriptions)}
        print("still has", sorted(mine & names), flush=True)
        if HANGS:
            ctypes.PyDLL(None).pause()  # as in DDS: nothing of Python's runs meanwhile
        super().destroy_node()

sys.exit(run_node(Leaving))
"""


@pytest.mark.parametrize(
    ("hangs", "fails", "code", "said"),
    [
        (False, False, 0, "still has []"),
        (True, False, 0, "in destroy_node"),
        (True, True, 2, "in destroy_node"),
    ],
)
def test_a_node_takes_its_topics_back_and_ends_even_if_dds_holds_it(
    hangs: bool, fails: bool, code: int, said: str, spawn: Callable[..., Any]
) -> None:
    text = NODE.replace("HANGS", str(hangs)).replace("FAILS", str(fails))
    node = spawn([sys.executable, "-c", text])
    node.wait_for_output("is up")
    assert (node.wait() if fails else node.stop()) == code
    assert said in node.output


LEAVES = """
import signal
from unittest.mock import Mock
from tomr_power_model.nodes.leaving import ends_later, leave
for _ in range(2):
    leave(Mock(subscriptions=[], publishers=[], services=[]))
ends_later(7)
signal.pause()
"""


def test_a_process_that_has_left_goes_on(spawn: Callable[..., Any]) -> None:
    # What would end it for what it has left would come before what does end it.
    assert spawn([sys.executable, "-c", LEAVES]).wait() == 7
