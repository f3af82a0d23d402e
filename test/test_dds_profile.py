"""config/fastdds.xml keeps messages out of shared memory, where killed nodes leave their ports."""

from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node

ROBOT = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")


@pytest.fixture
def node() -> Iterator[Node]:
    rclpy.init()
    try:
        yield Node("peer")
    finally:
        rclpy.shutdown()


def test_nodes_that_know_each_other_open_no_port_in_shared_memory(
    node: Node, spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    outlet = node.create_publisher(TwistStamped, "cmd_vel", 10)
    diagnosis = spawn(["tomr_diagnosis", "--ros-args", "--params-file", str(ROBOT)])
    wait_until(outlet.get_subscription_count, "a subscriber of cmd_vel")
    for process in ("self", str(diagnosis.pid)):
        assert "fastrtps_port" not in Path("/proc", process, "maps").read_text()
