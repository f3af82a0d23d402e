"""No message on any topic that a node hears stops it: each callback, called with the worst of its
type, and what the node does of its own accord after that."""

import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from importlib.resources import files
from itertools import product
from math import inf, nan
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
import rclpy
from attrs import frozen
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message

from tomr_fault_diag.classifier.messages import NAME
from tomr_fault_diag.nodes.diagnosis_node import DiagnosisNode
from tomr_fault_diag.nodes.fault_classifier_node import FaultClassifierNode
from tomr_fault_diag.nodes.power_residuals_node import PowerResidualsNode
from tomr_odometry.nodes.slip_odometry_node import SlipOdometryNode
from tomr_power_model.nodes import stage_node
from tomr_power_model.nodes.power_model_node import PowerModelNode
from tomr_power_model.nodes.stage_node import StageNode
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.nodes.sim_bridge_node import SimBridge
from tomr_view.nodes.view_node import ViewNode

REFERENCE = shipped_robot("reference")
FILE = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
NODES: dict[str, Callable[[], Node]] = {
    "power_model": PowerModelNode,
    "power_residuals": PowerResidualsNode,
    "fault_classifier": FaultClassifierNode,
    "tomr_diagnosis": DiagnosisNode,
    "slip_odometry": SlipOdometryNode,
    "sim_bridge": SimBridge,
    "tomr_view": partial(ViewNode, REFERENCE, "127.0.0.1", 0),
}
NUMBERS = (nan, inf, -inf, 3e38, -1.0, 0.0)
LENGTHS = (0, 1, 3, 4, 10, 200)
TEXTS = ("", "1e300", "-1", "0", NAME, "inputs: \x00", "inf", "nan")
# What the nodes look for in a status.
KEYS = ("residual", "band", "modelled", "code", "state", "p normal", "severity", "wheel", "topic")
SECOND = 10**9
LAST = 2**31 * SECOND - 1


def class_of(type_name: str) -> Any:
    package, name = type_name.split("/")
    return getattr(import_module(f"{package}.msg"), name)


@frozen
class Hostile:
    """Fills messages of any type: one number, length and text everywhere."""

    number: float
    length: int
    text: str
    stamp_ns: int

    def message(self, kind: Any) -> Any:
        made = kind()
        for name, type_name in kind.get_fields_and_field_types().items():
            setattr(made, name, self._value(getattr(made, name), type_name))
        if kind is DiagnosticStatus and self.length > 1:
            # A sentence ends with a unit, or its numbers are not looked at.
            made.message = "1 W"
            made.name = NAME if self.length == 3 else made.name
        return made

    def _value(self, old: Any, type_name: str) -> Any:
        if type_name == "sequence<string>":  # of names: those of joints that there are
            return [REFERENCE.wheel_names[n % 3] for n in range(self.length)]
        if type_name == "sequence<diagnostic_msgs/KeyValue>":
            return [KeyValue(key=key, value=self.text) for key in KEYS]
        if type_name.startswith("sequence<"):
            item = type_name.removeprefix("sequence<").removesuffix(">")
            return [self._value(None, item)] * self.length
        if isinstance(old, np.ndarray):
            return np.full(old.shape, self.number, dtype=old.dtype)
        if type_name == "builtin_interfaces/Time":
            return Time(sec=self.stamp_ns // SECOND, nanosec=self.stamp_ns % SECOND)
        if "/" in type_name:
            return self.message(class_of(type_name))
        number = {"float": self.number, "double": self.number}
        return {"string": self.text, "octet": b"\xff", "boolean": True, **number}.get(type_name, 3)


@pytest.fixture
def node(request: pytest.FixtureRequest) -> Iterator[Node]:
    rclpy.init(args=["--ros-args", "--params-file", FILE])
    made = NODES[request.param]()
    yield made
    made.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize("node", NODES, indirect=True)
def test_a_node_survives_whatever_it_hears(node: Node) -> None:
    heard = [subscription for subscription in node.subscriptions if subscription.callback]
    assert heard
    start = time.time_ns()
    for count, case in enumerate(product(NUMBERS, LENGTHS, TEXTS)):
        # A stamp beyond all others comes late: what follows it is from before.
        for stamp_ns in (0, start + count * SECOND // 50, *((LAST,) if count % 100 == 99 else ())):
            for subscription in heard:
                message = Hostile(*case, stamp_ns).message(subscription.msg_type)
                subscription.callback(serialize_message(message) if subscription.raw else message)
        for timer in node.timers:
            timer.callback()


@pytest.mark.parametrize("node", ["fault_classifier"], indirect=True)
def test_a_node_takes_neither_a_flood_nor_what_is_too_large(
    node: StageNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(node, "complain", lambda _, problem: said.append(problem))
    (heard,) = (subscription for subscription in node.subscriptions if subscription.raw)
    message = heard.msg_type()
    message.header.stamp.sec = 1
    data = serialize_message(message)
    for _ in range(1210):
        heard.callback(data)
    heard.callback(data + bytes(2_000_000))
    assert sum("more than 1200 messages a second" in problem for problem in said) == 10
    assert "bytes: left out" in said[-1]


@pytest.mark.parametrize("node", ["power_model"], indirect=True)
def test_a_flood_of_encoders_is_thinned_before_it_is_read(
    node: StageNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = MagicMock(side_effect=deserialize_message)
    monkeypatch.setattr(stage_node, "deserialize_message", read)
    monkeypatch.setattr(node, "complain", lambda *_: None)
    (heard,) = (item for item in node.subscriptions if item.topic_name == "/joint_states")
    message = heard.msg_type()
    for nanosec in range(0, SECOND // 10, 200_000):  # 5 kHz
        message.header.stamp = Time(sec=1, nanosec=nanosec)
        heard.callback(serialize_message(message))
    assert read.call_count == 100
