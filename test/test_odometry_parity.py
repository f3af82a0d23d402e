"""A recording through the node `slip_odometry` over DDS and through the offline core: the same."""

from collections.abc import Callable
from operator import itemgetter
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from replays import TIMING, is_heard_reliably, listening, playing

from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.topics import estimate_messages, outputs
from tomr_power_model.messages.bag import jazzy_typestore, to_bag
from tomr_power_model.nodes.stage_node import STAGE_QOS, message_class
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.inputs import Complaints

BAG = Path(__file__).parents[1] / "bags" / "square"
SENSORS = ("cmd_vel", "joint_states", "wheel_1/power", "imu/data")
SETTINGS = OdometrySettings.given({**TIMING, "publish_floor": True}, "test")

Key = tuple[str, int]


def _offline() -> dict[Key, bytes]:
    robot, store = shipped_robot("reference"), jazzy_typestore()
    core, found = SlipOdometry(robot, SETTINGS), {}
    with open_recording(BAG) as recording:
        for item in estimates(recording, robot, core, Complaints()):
            for one in estimate_messages(robot, item, SETTINGS):
                name = one.message.type_name
                data = bytes(store.serialize_cdr(to_bag(one.message), name))
                found[one.topic, one.stamp_ns] = data
    return found


@pytest.mark.serial  # beside other tests commands may come too late
def test_node_and_offline_tool_publish_the_same(
    spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    if not BAG.exists():
        pytest.fail(f"{BAG} is missing: make bags")
    store, online = jazzy_typestore(), {}
    rclpy.init()
    node, executor = Node("listener"), SingleThreadedExecutor()
    executor.add_node(node)
    try:
        for topic, name in outputs(SETTINGS).items():

            def keep(data: bytes, topic: str = topic, name: str = name) -> None:
                message = store.deserialize_cdr(data, name)
                stamp = message.header.stamp
                again = bytes(store.serialize_cdr(message, name))
                online[topic, stamp.sec * 1_000_000_000 + stamp.nanosec] = again

            node.create_subscription(message_class(name), topic, keep, STAGE_QOS, raw=True)
        spawn(["slip_odometry", *listening(BAG), "-p", "publish_floor:=true"])

        def connected() -> bool:
            executor.spin_once(0.01)
            published = all(node.count_publishers(topic) == 1 for topic in outputs(SETTINGS))
            return published and is_heard_reliably(node, SENSORS)

        wait_until(connected, "the node, which asks again for what it missed")
        replay = spawn(playing(BAG))
        while replay.popen.poll() is None:
            executor.spin_once(0.05)
        offline = _offline()

        def complete() -> bool:
            executor.spin_once(0.05)
            return len(online) >= len(offline)

        wait_until(complete, f"{len(offline)} messages, as the offline tool gives")
    finally:
        node.destroy_node()
        rclpy.shutdown()
    assert set(online) == set(offline)
    different = [key for key, data in online.items() if data != offline[key]]
    assert not different, (len(different), sorted(different, key=itemgetter(1))[:5])
