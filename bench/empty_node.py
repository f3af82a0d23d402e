"""The baseline: `empty_node.py NAME` hears all that node NAME of the suite hears, and does nothing.

Same topics, types and QoS, taken from the same tables as the node's own, and the same executor.
It publishes nothing.
"""

import sys
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.outgoing import TYPES
from tomr_power_model.messages.types import DIAGNOSTICS
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.nodes.stage_node import SENSOR_QOS, STAGE_QOS, message_class, run_node
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.inputs import model_inputs
from tomr_power_model.topics.predictions import prediction_topics

Heard = tuple[str, str, QoSProfile]  # topic, type, QoS


def _power_model() -> list[Heard]:
    robot = shipped_robot("reference")
    inputs = model_inputs(robot, PowerPredictor(robot))
    return [(item.topic, item.type_name, SENSOR_QOS) for item in inputs]


def _power_residuals() -> list[Heard]:
    robot = shipped_robot("reference")
    inputs = residual_inputs(robot, ResidualStage(robot))
    return [
        *((topic, TYPES[kind], STAGE_QOS) for topic, kind in prediction_topics(robot).items()),
        *((item.topic, item.type_name, SENSOR_QOS) for item in inputs),
    ]


def _fault_classifier() -> list[Heard]:
    return [(RESIDUALS, DIAGNOSTICS, STAGE_QOS)]


HEARD: dict[str, Callable[[], list[Heard]]] = {
    "power_model": _power_model,
    "power_residuals": _power_residuals,
    "fault_classifier": _fault_classifier,
}


def make(name: str) -> Node:
    """A node that hears what `name` hears."""
    node = Node(f"empty_{name}")
    for topic, type_name, qos in HEARD[name]():
        node.create_subscription(message_class(type_name), topic, _nothing, qos)
    return node


def _nothing(message: Any) -> None:
    pass


if __name__ == "__main__":
    sys.exit(run_node(lambda: make(sys.argv[1])))
