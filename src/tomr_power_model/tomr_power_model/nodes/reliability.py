"""Whether a subscription asks again for what it missed: the override that ROS 2 has for it.

rclpy's QoSOverridingOptions writes into the profile that it is given, which topics share, leaves
what was given free to change while nothing follows it, and ends a node with a trace for a wrong
value; so the parameter of that name is checked and declared as all others are.
"""

from attrs import evolve
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from tomr_power_model.nodes.robot_parameters import redeclare
from tomr_power_model.robot.parameters import ParameterSpec

_SPEC = ParameterSpec(
    "reliability",
    "reliable: asks again for what was lost, hears reliable publishers only; best_effort: hears "
    "all, once",
    "str",
    choices=("best_effort", "reliable"),
)


def subscription_qos(node: Node, topic: str, usual: QoSProfile) -> QoSProfile:
    """The quality of service of a topic's subscription, with the reliability of the parameter
    `qos_overrides.<full topic name>.subscription.reliability` where it is given.

    Raises InputError for one that there is not.
    """
    name = f"qos_overrides.{node.resolve_topic_name(topic)}.subscription.reliability"
    usually = usual.reliability.name.lower()
    spec = evolve(_SPEC, name=name, default=usually)
    given = node.get_parameter(name).value if node.has_parameter(name) else usually
    chosen = str(spec.check(given, node.get_name()))
    # A topic that is subscribed to again has it already, read only.
    if not node.has_parameter(name) or not node.describe_parameter(name).read_only:
        redeclare(node, spec, chosen)
    return QoSProfile(depth=usual.depth, reliability=ReliabilityPolicy[chosen.upper()])
