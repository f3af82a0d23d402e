"""A recording played to nodes that ask again for what they missed, on machines that are busy."""

from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from tomr_power_model.recordings import open_recording

ROBOT = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
RATE = 1.0  # times real time: a node held up for seconds falls behind by no more
# [s], for which node and offline core wait for what is sent again: commands, samples.
TIMING = {"patience": 5.0, "settle_time": 3.0}


def listening(bag: Path) -> list[str]:
    """Arguments of a node that asks again for what it missed of a bag's topics."""
    given = {name: str(value) for name, value in TIMING.items()}
    with open_recording(bag) as recording:
        for topic in recording.topics:
            given[f"qos_overrides.{topic}.subscription.reliability"] = "reliable"
    parameters = [part for item in given.items() for part in ("-p", ":=".join(item))]
    return ["--ros-args", "--params-file", str(ROBOT), *parameters]


def playing(bag: Path) -> list[str]:
    """The command that plays a bag."""
    return ["bag_replay", "--ros-args", "-p", f"bag:={bag}", "-p", f"rate:={RATE}"]


def is_heard_reliably(node: Node, topics: Iterable[str]) -> bool:
    """Whether all that subscribe to these topics ask again; False while one has no subscriber."""
    found = [node.get_subscriptions_info_by_topic(topic) for topic in topics]
    asks = ReliabilityPolicy.RELIABLE
    return all(each and all(one.qos_profile.reliability == asks for one in each) for each in found)
