"""Whether sensor topics are asked for again when messages get lost."""

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import ReliabilityPolicy

from tomr_power_model.errors import InputError
from tomr_power_model.nodes.reliability import subscription_qos
from tomr_power_model.nodes.stage_node import SENSOR_QOS, STAGE_QOS

NAME = "qos_overrides./robot/joint_states.subscription.reliability"


@pytest.fixture
def context() -> Iterator[None]:
    rclpy.init()
    yield
    rclpy.shutdown()


def _node(*reliability: object) -> Node:
    return Node(
        "node",
        namespace="robot",
        parameter_overrides=[Parameter(NAME, value=value) for value in reliability],
        automatically_declare_parameters_from_overrides=True,
    )


@pytest.mark.usefixtures("context")
def test_samples_are_not_asked_for_again_unless_the_parameter_says_so() -> None:
    usual, asked = _node(), _node("reliable")
    assert subscription_qos(usual, "joint_states", SENSOR_QOS) == SENSOR_QOS
    assert subscription_qos(asked, "joint_states", SENSOR_QOS) == STAGE_QOS
    assert subscription_qos(asked, "wheel_1/power", SENSOR_QOS) == SENSOR_QOS
    assert SENSOR_QOS.reliability == ReliabilityPolicy.BEST_EFFORT
    # A topic may be subscribed to again; meanwhile the parameter keeps what it was.
    asked.set_parameters([Parameter(NAME, value="best_effort")])
    assert subscription_qos(asked, "joint_states", SENSOR_QOS) == STAGE_QOS
    assert asked.describe_parameter(NAME).read_only


@pytest.mark.usefixtures("context")
@pytest.mark.parametrize("wrong", ["sometimes", 1])
def test_another_reliability_is_refused_with_its_remedy(wrong: object) -> None:
    node = _node(wrong)
    with pytest.raises(InputError, match=rf"^node: {NAME} = .*(best_effort, reliable|a text)"):
        subscription_qos(node, "joint_states", SENSOR_QOS)
