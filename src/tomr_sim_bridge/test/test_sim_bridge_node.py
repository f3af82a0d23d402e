"""sim_bridge as a process of its own: topics, clock, commands, faults while running, its end."""

import math
import signal
import time
from collections.abc import Callable, Iterator
from importlib.resources import files
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped, Vector3
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, Imu, JointState

from tomr_sim_bridge.nodes import sim_bridge_node
from tomr_sim_bridge.nodes.sim_bridge_node import SimBridge

BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
TYPES = {
    "joint_states": JointState,
    "wheel_1/power": BatteryState,
    "wheel_2/power": BatteryState,
    "wheel_3/power": BatteryState,
    "battery_state": BatteryState,
    "imu/data": Imu,
    "odom": Odometry,
    "ground_truth/odom": Odometry,
    "ground_truth/faults": DiagnosticArray,
    "/clock": Clock,
}
ROBOT = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))


def command_of(*parameters: str, robot: str = ROBOT) -> list[str]:
    pairs = [part for parameter in parameters for part in ("-p", parameter)]
    return ["sim_bridge", "--ros-args", "--params-file", robot, *pairs]


class Operator:
    """In this process: hears all topics, commands, sets parameters."""

    def __init__(self, context: Context) -> None:
        self.node = Node("operator", context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {topic: [] for topic in TYPES}
        for topic, kind in TYPES.items():
            qos = RELIABLE if topic == "odom" else BEST_EFFORT  # as who navigates asks for
            self.node.create_subscription(kind, topic, self.heard[topic].append, qos)
        self._parameters = AsyncParameterClient(self.node, "sim_bridge")

    def spin(self) -> None:
        """Take what has come in, some hundred messages a second."""
        end = time.monotonic() + 0.02
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.005)

    def last(self, topic: str) -> Any:
        self.spin()
        return self.heard[topic][-1] if self.heard[topic] else None

    def set(self, name: str, value: object) -> tuple[bool, str]:
        future = self._parameters.set_parameters([Parameter(name, value=value)])
        while not future.done():
            self.spin()
        result = future.result().results[0]
        return result.successful, result.reason

    def commanding(self, outlet: Any, message: Any, topic: str = "joint_states") -> Any:
        """Command once more, as a real operator does, and return the last message of a topic.

        sim_bridge may not yet know of a publisher that already knows of it.
        """
        outlet.publish(message)
        return self.last(topic)

    def truth(self, fault_id: str) -> dict[str, float]:
        message = self.last("ground_truth/faults")
        status = next((s for s in message.status if s.name == fault_id), None) if message else None
        return {pair.key: float(pair.value) for pair in status.values} if status else {}

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def operator() -> Iterator[Operator]:
    context = Context()
    rclpy.init(context=context)
    found = Operator(context)
    yield found
    found.close()
    context.shutdown()


def test_robot_on_topics(operator: Operator, spawn: Callable, wait_until: Callable) -> None:
    bridge = spawn(command_of("start_time:=100.0", "publish_clock:=true"))
    wait_until(lambda: operator.spin() or all(operator.heard.values()), "a message on every topic")
    assert 100 <= operator.heard["joint_states"][0].header.stamp.sec < 115
    assert operator.heard["joint_states"][0].name == [f"wheel_{n}_joint" for n in (1, 2, 3)]
    assert operator.heard["wheel_2/power"][-1].current == pytest.approx(-0.05, abs=0.03)
    assert min(operator.heard["odom"][0].pose.covariance[::7]) > 0.0

    outlet = operator.node.create_publisher(TwistStamped, "cmd_vel", 10)
    message = TwistStamped()
    message.twist.linear.y = 0.3
    wait_until(
        lambda: operator.commanding(outlet, message).velocity[0] < -5.8, "wheel 1 at -6 rad/s"
    )
    message.twist.linear.y = math.nan
    outlet.publish(message)
    bridge.wait_for_output("is not finite: ignored, the last command is kept")

    assert operator.set("faults.encoder_lost.wheel", 2) == (True, "")
    assert operator.set("faults.encoder_lost.severity", 1.0) == (True, "")
    wait_until(lambda: operator.truth("encoder_lost").get("active") == 1.0, "the fault in force")
    assert operator.truth("encoder_lost")["wheel"] == 2.0
    wait_until(lambda: operator.last("joint_states").velocity[1] == 0.0, "wheel 2 reads standstill")
    assert operator.last("joint_states").velocity[0] < -5.0  # the NaN stopped nothing
    ok, reason = operator.set("faults.encoder_lost.severity", 1.5)
    assert not ok
    assert "1.5" in reason
    ok, reason = operator.set("robot.mass", 3.0)
    assert not ok
    assert operator.set("faults.encoder_lost.severity", 0.0) == (True, "")
    wait_until(lambda: operator.truth("encoder_lost").get("active") == 0.0, "the fault is over")

    clock = [c.clock.sec * 10**9 + c.clock.nanosec for c in operator.heard["/clock"]]
    assert clock == sorted(clock)
    bridge.signal(signal.SIGINT, group=True)
    assert bridge.wait(10.0) == 0
    assert "Traceback" not in bridge.output


def test_real_time_that_cannot_be_held_slows_the_clock(
    operator: Operator, spawn: Callable, wait_until: Callable
) -> None:
    bridge = spawn(command_of("real_time_factor:=100.0", "start_time:=1.0"))
    # Odometry is reliable; taken all the while, as what waits too long is dropped.
    heard = operator.heard["odom"]
    wait_until(
        lambda: operator.spin() or (len(heard) > 50 and "cannot be held" in bridge.output),
        "100 times real time cannot be held",
    )
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in heard]
    assert {later - earlier for earlier, later in pairwise(stamps)} == {50_000_000}
    assert stamps == sorted(stamps)
    assert bridge.stop() == 0
    assert bridge.output.count("cannot be held") == 1  # throttled


@pytest.mark.parametrize("parameters", [["cmd_vel_type:=twist"], []])
def test_twist_without_stamp(
    parameters: list[str], operator: Operator, spawn: Callable, wait_until: Callable
) -> None:
    spawn(command_of(*parameters))
    outlet = operator.node.create_publisher(Twist, "cmd_vel", 10)
    message = Twist()
    message.angular.z = 1.0
    wait_until(
        lambda: (heard := operator.commanding(outlet, message)) and heard.velocity[0] < -3.8,
        "wheels at -4 rad/s",
    )


@pytest.fixture
def bridge(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[SimBridge, list[str]]]:
    """The node in this process, as where tf2_msgs is installed, and the topics that it fills."""
    topics: list[str] = []
    monkeypatch.setattr(sim_bridge_node, "find_spec", lambda name: name)
    monkeypatch.setattr(sim_bridge_node, "to_ros", lambda message: message)
    rclpy.init(args=["--ros-args", "--params-file", ROBOT])
    made = SimBridge()
    outlet = SimpleNamespace(publish=lambda _: None)
    monkeypatch.setattr(made, "_outlet", lambda topic, _: topics.append(topic) or outlet)
    yield made, topics
    made.destroy_node()
    rclpy.shutdown()


def test_it_stops_when_commands_stop(bridge: tuple[SimBridge, list[str]]) -> None:
    node, topics = bridge
    simulation = node._simulation
    start = simulation.stamp_ns
    node._command(Twist(linear=Vector3(x=0.2)))

    def speed(until: float) -> float:
        samples = simulation.step_to(start + round(until * 1e9))
        for sample in samples:
            node._publish(sample)
        (last,) = [s for s in samples if s.topic == "odom"][-1:]
        return float(last.message.fields["twist"].fields["twist"].fields["linear"].fields["x"])

    assert speed(0.4) == pytest.approx(0.2, abs=0.05)
    assert speed(1.5) == pytest.approx(0.0, abs=0.01)
    assert topics.count("tf") == topics.count("odom") > 20


def test_commands_of_a_type_that_is_not_heard(operator: Operator, spawn: Callable) -> None:
    bridge = spawn(command_of("cmd_vel_type:=twist_stamped"))
    operator.node.create_publisher(Twist, "cmd_vel", 10)
    output = bridge.wait_for_output("which is not heard")
    assert "/cmd_vel: published as geometry_msgs/msg/Twist, which is not heard" in output


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (["robot.mass:=-1.0"], "robot.mass = -1 kg: out of range"),
        (["seed:=1.5"], "seed"),
        (["faults.encoder_lost.wheel:=7"], "faults.encoder_lost.wheel = 7: out of range"),
    ],
)
def test_bad_parameters_end_it_with_one_line(
    parameters: list[str], message: str, spawn: Callable
) -> None:
    bridge = spawn(command_of(*parameters))
    assert bridge.wait() == 2
    errors = [line for line in bridge.output.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert "Traceback" not in bridge.output


def test_robot_that_flies_apart_ends_it_with_one_line(
    operator: Operator, spawn: Callable, wait_until: Callable
) -> None:
    bridge = spawn(command_of("motor.resistance:=0.0001"))
    outlet = operator.node.create_publisher(TwistStamped, "cmd_vel", 10)
    message = TwistStamped()
    message.twist.linear.y = 0.3

    def ended() -> bool:
        operator.commanding(outlet, message)
        return bridge.popen.poll() is not None

    wait_until(ended, "the end of sim_bridge")
    assert bridge.wait() == 2
    said = [line for line in bridge.output.splitlines() if not line.startswith("[")]  # no log
    assert len(said) == 1
    assert said[0].startswith("error: the simulated robot has become unstable")


def test_a_missing_parameter_file_is_one_line(spawn: Callable) -> None:
    bridge = spawn(command_of(robot="nowhere/robot.yaml"))
    assert bridge.wait() == 2
    assert bridge.output == (
        "error: sim_bridge: --params-file nowhere/robot.yaml: no such file: give a robot.yaml\n"
    )


def test_without_a_robot_it_says_what_to_do(spawn: Callable) -> None:
    bridge = spawn(["sim_bridge"])
    assert bridge.wait() == 2
    assert "start it with --params-file robot.yaml" in bridge.output
