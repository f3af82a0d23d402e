"""tomr_view beside a simulated robot and its diagnosis, over DDS."""

import json
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from websockets.sync.client import ClientConnection, connect

from tomr_fault_diag.classifier.messages import NAME
from tomr_power_model.robot import shipped_robot
from tomr_view.nodes.view_node import ViewNode

ROBOT = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
NAMESPACE = ["-r", "__ns:=/r1"]


def spawn_robot(spawn: Callable[..., Any]) -> Any:
    """A robot with its diagnosis, in a namespace; returns the process of its page."""
    for command in ("sim_bridge", "tomr_diagnosis"):
        spawn([command, "--ros-args", "--params-file", ROBOT, *NAMESPACE])
    return spawn(["tomr_view", "--port", "0", "--ros-args", *NAMESPACE])


def next_of(client: ClientConnection, kind: str) -> dict[str, Any]:
    while (message := json.loads(client.recv(30.0)))["kind"] != kind:
        pass
    return message


def test_a_page_sees_a_robot_and_switches_a_fault_of_the_simulator(
    spawn: Callable[..., Any],
) -> None:
    view = spawn_robot(spawn)
    output = view.wait_for_output("watch at http://127.0.0.1:")
    place = output.partition("watch at http://")[2].split("/")[0]
    with connect(f"ws://{place}/socket", max_size=None) as client:
        hello = next_of(client, "hello")
        assert hello["title"] == "/r1"
        faults = hello["faults"] or next_of(client, "update")["faults"]
        assert {"id": "encoder_lost", "has_wheel": True} in faults
        picture = next_of(client, "picture")["picture"]
        assert picture["speeds"] == [0.0, 0.0, 0.0]
        for wish in (
            {"id": "encoder_lost", "wheel": 9, "severity": 1},  # refused
            {"id": "../encoder_lost"},
            {"id": "encoder_lost", "wheel": 2, "severity": 1},
        ):
            client.send(json.dumps({"ask": "fault", **wish}))
        while not picture["faults"] or picture["message"] == "no diagnosis yet":
            picture = next_of(client, "picture")["picture"]
        assert picture["faults"] == [{"id": "encoder_lost", "wheel": 2}]
        assert picture["message"].startswith("waiting")
        client.send(json.dumps({"ask": "fault", "id": None}))
        while picture["faults"]:
            picture = next_of(client, "picture")["picture"]
    assert "wheel = 9: out of range" in view.output


@pytest.mark.parametrize(("namespace", "shown"), [("/r1", "of r1"), ("/", "of no namespace")])
def test_what_is_said_of_other_robots_is_not_shown(namespace: str, shown: str) -> None:
    names = {"/r1/": "of r1", "/r2/": "of r2", "/r1/r2/": "of another fleet", "": "of no namespace"}
    rclpy.init(args=["--ros-args", "-r", f"__ns:={namespace}"])
    node = ViewNode(shipped_robot("reference"), "127.0.0.1", 0)
    statuses = [DiagnosticStatus(name=prefix + NAME, message=m) for prefix, m in names.items()]
    seen = []
    for order in (statuses, statuses[::-1]):
        node._diagnosis(DiagnosticArray(status=order), 0)
        seen.append(node._gatherer.status)
    node.destroy_node()
    rclpy.shutdown()
    assert [status and status.message for status in seen] == [shown, shown]
