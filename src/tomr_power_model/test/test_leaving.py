"""How a node leaves ROS, and that it does whatever DDS does."""

import faulthandler
import sys
from collections.abc import Callable
from typing import Any
from unittest.mock import Mock

import pytest

from tomr_power_model.nodes.leaving import leave

NODE = """
import ctypes, sys
from rclpy.node import Node
from std_msgs.msg import String
from tomr_power_model.nodes.stage_node import run_node

class Leaving(Node):
    def __init__(self):
        super().__init__("leaving")
        self.create_publisher(String, "said", 1)
        self.create_subscription(String, "heard", lambda _: None, 1)
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
    ("hangs", "code", "said"), [(False, 0, "still has []"), (True, 1, "in destroy_node")]
)
def test_a_node_takes_its_topics_back_and_ends_even_if_dds_holds_it(
    hangs: bool, code: int, said: str, spawn: Callable[..., Any]
) -> None:
    node = spawn([sys.executable, "-c", NODE.replace("HANGS", str(hangs))])
    node.wait_for_output("is up")
    assert node.stop() == code
    assert said in node.output


def test_a_process_that_goes_on_is_not_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = Mock()
    for name in ("dump_traceback_later", "cancel_dump_traceback_later"):
        monkeypatch.setattr(faulthandler, name, getattr(calls, name))
    leave(Mock(subscriptions=[], publishers=[], services=[], destroy_node=calls.destroy_node))
    assert [name for name, *_ in calls.mock_calls] == [
        "dump_traceback_later",
        "destroy_node",
        "cancel_dump_traceback_later",
    ]
