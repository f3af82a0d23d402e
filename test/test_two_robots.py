"""Two simulated robots side by side, each in its namespace with a diagnosis of its own."""

from collections import defaultdict
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

from tomr_sim_bridge.nodes.sim_bridge_node import LATCHED_QOS

ROBOT = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
TWISTS = {"left": (0.2, 0.0, 0.5), "right_2": (0.0, -0.3, -0.4)}
DRIVEN_S = 4.0  # of each robot's own time


class Fleet:
    """Drives the robots and hears what is said of them."""

    def __init__(self) -> None:
        self.node = Node("fleet")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self.said: dict[str, list[DiagnosticStatus]] = defaultdict(list)
        self.described: dict[str, str] = {}
        self.odometry: dict[str, list[float]] = defaultdict(list)  # stamps [s]
        self._outlets = {
            name: self.node.create_publisher(TwistStamped, f"/{name}/cmd_vel", 10)
            for name in TWISTS
        }
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 100)
        for name in TWISTS:
            # Commands in each robot's own time: a busy machine may let one fall behind.
            self.node.create_subscription(
                Odometry, f"/{name}/odom", lambda odom, name=name: self._command(name, odom), 10
            )
            self.node.create_subscription(
                String,
                f"/{name}/robot_description",
                lambda text, name=name: self.described.update({name: text.data}),
                LATCHED_QOS,
            )

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.endswith("fault_classifier: drive"):
                self.said[status.hardware_id].append(status)

    def _command(self, name: str, odom: Odometry) -> None:
        stamp = odom.header.stamp
        self.odometry[name].append(stamp.sec + 1e-9 * stamp.nanosec)
        message = TwistStamped(header=odom.header)
        message.twist.linear.x, message.twist.linear.y, message.twist.angular.z = TWISTS[name]
        self._outlets[name].publish(message)

    def spin(self) -> None:
        self._executor.spin_once(0.02)

    def are_normal(self) -> bool:
        self.spin()
        return all(
            self.said[name] and self.said[name][-1].message.startswith("normal") for name in TWISTS
        )

    def have_driven(self, since: dict[str, float], seconds: float) -> bool:
        """Whether each has gone on for so long in its own time."""
        self.spin()
        return all(self.odometry[name][-1] - since[name] > seconds for name in TWISTS)


def test_two_robots_drive_without_a_false_alarm(
    spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    for name in TWISTS:
        for command in ("sim_bridge", "tomr_diagnosis"):
            arguments = ["--ros-args", "--params-file", ROBOT, "-r", f"__ns:=/{name}"]
            spawn([command, *arguments])
    rclpy.init()
    fleet = Fleet()
    try:
        wait_until(fleet.are_normal, "both robots drive and are called normal", 40.0)
        begun = {name: stamps[-1] for name, stamps in fleet.odometry.items()}
        wait_until(lambda: fleet.have_driven(begun, DRIVEN_S), "both have driven on", 60.0)
        assert fleet.node.count_publishers("/clock") == 0
    finally:
        fleet.node.destroy_node()
        rclpy.shutdown()
    assert set(fleet.said) == set(TWISTS)
    for name, statuses in fleet.said.items():
        assert {status.name for status in statuses} == {f"/{name}/fault_classifier: drive"}
        wrong = [s.message for s in statuses if s.level in (b"\x01", b"\x02")]
        assert not wrong
        assert "wheel_1_joint" in fleet.described[name]
