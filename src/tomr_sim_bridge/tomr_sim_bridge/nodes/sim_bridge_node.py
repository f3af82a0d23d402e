"""Node `sim_bridge`: the simulated robot on the topics of a real one."""

import time
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import attrs
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock as ClockMessage

from tomr_power_model.cli import run_main
from tomr_power_model.errors import InputError
from tomr_power_model.messages import plain
from tomr_power_model.messages.intake import Unusable, stamp_of, twist_of
from tomr_power_model.messages.motion import transform_of
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.messages.types import TEXT
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.command_type import CommandType
from tomr_power_model.nodes.robot_parameters import declare_robot, declare_specs
from tomr_power_model.nodes.stage_node import (
    HEARD,
    SENSOR_QOS,
    STAGE_QOS,
    message_class,
    run_node,
    to_ros,
)
from tomr_power_model.robot.parameters import CMD_VEL_TYPE, ParameterSpec, Value
from tomr_power_model.robot.urdf import urdf_of
from tomr_sim_bridge.faults import all_parameters, split_name
from tomr_sim_bridge.plant.drivers import COMMAND_TIMEOUT
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.simulation import Simulation

DESCRIPTION = """\
The simulated robot on the topics of a real one: joint_states, <wheel>/power, battery_state,
imu/data, odom, robot_description (URDF), ground_truth/odom, ground_truth/faults, tf where
tf2_msgs is installed, and /clock where asked. Listens to cmd_vel.
Takes the parameters below and the robot's description, from a robot.yaml."""
EPILOG = """\
examples:
  sim_bridge --ros-args --params-file robot.yaml -p publish_clock:=true
  sim_bridge --ros-args --params-file robot.yaml -r __ns:=/robot_2
  sim_bridge --ros-args --params-file robot.yaml -p faults.encoder_lost.severity:=1.0
  ros2 param set /sim_bridge faults.floor_slippery.severity 0.9

exit codes: 0 after SIGINT or SIGTERM; 2 bad input."""
SLICE_NS = 10_000_000  # of the plant between two looks at this computer's clock
LONGEST_RUN_NS = 50_000_000  # of this computer between two looks at commands and parameters
LONGEST_LEAP_NS = 50_000_000  # of the plant at once at real time; what is more slows the clock
NOTICEABLE_NS = 500_000_000  # that the clock was slowed by
FOREIGN_NS = 1_000_000_000  # between a command's stamp and a clock that is not its own
# A description stays to be had by who comes later.
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ODOMETRY_TOPIC = "odom"
WARN_PERIOD = 10.0  # s between two warnings of a kind

_S = ParameterSpec
PARAMETERS = (
    CMD_VEL_TYPE,
    _S(
        "publish_clock",
        "give the time on /clock; one robot can, of several",
        kind="bool",
        default=False,
    ),
    _S("publish_tf", "base_link in odom, where tf2_msgs is installed", kind="bool", default=True),
    _S(
        "real_time_factor",
        "seconds of the robot per second",
        default=1.0,
        minimum=0.01,
        maximum=100.0,
        read_only=False,
    ),
    _S(
        "update_rate",
        "of the plant and /clock",
        unit="Hz",
        default=100.0,
        minimum=10.0,
        maximum=1e3,
    ),
    _S(
        "start_time",
        "stamp of the start; 0: the time of this computer",
        unit="s",
        default=0.0,
        minimum=0.0,
        maximum=4e9,
    ),
    _S("seed", "of sensor noise", kind="int", default=0, minimum=0, maximum=2**31 - 1),
    _S("payload", "on top of the description", unit="kg", default=0.0, minimum=0.0, maximum=1e4),
    _S(
        "floor_friction",
        "traction coefficient; 0: that of the description",
        default=0.0,
        minimum=0.0,
        maximum=10.0,
    ),
    _S(
        "command_timeout",
        "a command this old counts as a stop; 0: it is held",
        unit="s",
        default=COMMAND_TIMEOUT,
        minimum=0.0,
        maximum=60.0,
    ),
    _S("stamp_jitter", "of the sampling times", unit="s", default=0.0, minimum=0.0, maximum=1.0),
)
FAULT_PARAMETERS = {name: attrs.evolve(spec, name=name) for name, spec in all_parameters().items()}


class SimBridge(Node):
    """Runs the plant in real time, or at a multiple of it, and publishes what it measures."""

    def __init__(self) -> None:
        super().__init__("sim_bridge", automatically_declare_parameters_from_overrides=True)
        values = declare_specs(self, (*PARAMETERS, *FAULT_PARAMETERS.values()))
        robot = declare_robot(self)
        start = round(_number(values, "start_time") * NANOSECONDS) or time.time_ns()
        self._simulation = Simulation(
            robot,
            int(_number(values, "seed")),
            start_ns=start,
            floor_friction=_number(values, "floor_friction") or None,
            payload=_number(values, "payload"),
            stamp_jitter=_number(values, "stamp_jitter"),
            command_timeout=_number(values, "command_timeout"),
        )
        self._factor = _number(values, "real_time_factor")
        self._slowed_ns = 0
        self.failure: InputError | None = None
        for fault_id in {split_name(name)[0] for name in FAULT_PARAMETERS}:
            self._set_fault(fault_id)
        self.add_post_set_parameters_callback(self._parameters_set)
        self._topics: dict[str, Any] = {}
        self._clock_outlet = (
            self.create_publisher(ClockMessage, "/clock", STAGE_QOS)
            if values["publish_clock"]
            else None
        )
        self._has_tf = bool(values["publish_tf"]) and find_spec("tf2_msgs") is not None
        described = self.create_publisher(message_class(TEXT), "robot_description", LATCHED_QOS)
        described.publish(message_class(TEXT)(data=urdf_of(robot)))
        CommandType(
            self,
            "cmd_vel",
            str(values["cmd_vel_type"]),
            lambda name: self.create_subscription(
                message_class(name), "cmd_vel", self._command, SENSOR_QOS
            ),
        )
        self._anchor()
        # A timer on the node's own clock would wait for the /clock that it makes.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / _number(values, "update_rate"), self._advance, clock=steady)

    def _anchor(self) -> None:
        """Hold the plant's time against this computer's from now on."""
        self._wall_ns, self._plant_ns = time.monotonic_ns(), self._simulation.stamp_ns

    def _advance(self) -> None:
        try:
            self._run()
        except InputError as error:  # the plant has become unstable
            self.failure = error

    def _run(self) -> None:
        now = time.monotonic_ns()
        simulation = self._simulation
        target = self._reachable(now)
        while True:
            reached = min(target, simulation.stamp_ns + SLICE_NS)
            for sample in simulation.step_to(reached):
                self._publish(sample)
            if reached == target or time.monotonic_ns() - now > LONGEST_RUN_NS:
                break
        if self._clock_outlet is not None:
            stamp = to_ros(plain.time(simulation.stamp_ns))
            self._clock_outlet.publish(ClockMessage(clock=stamp))

    def _reachable(self, now: int) -> int:
        """Where the plant is to be, but no long way on: it would pass commands still under way."""
        target = self._plant_ns + round((now - self._wall_ns) * self._factor)
        most = self._simulation.stamp_ns + round(LONGEST_LEAP_NS * max(1.0, self._factor))
        if target <= most:
            return target
        self._wall_ns, self._plant_ns = now, most
        self._slowed_ns += round((target - most) / self._factor)
        if self._slowed_ns > NOTICEABLE_NS:
            self.get_logger().warning(
                f"{self._factor:g} times real time cannot be held: the clock is slowed; "
                "lower real_time_factor",
                throttle_duration_sec=WARN_PERIOD,
            )
            self._slowed_ns = 0
        return most

    def _publish(self, sample: Sample) -> None:
        self._outlet(sample.topic, sample.message.type_name).publish(to_ros(sample.message))
        if sample.topic == ODOMETRY_TOPIC and self._has_tf:
            moved = transform_of(sample.message)
            self._outlet("tf", moved.type_name).publish(to_ros(moved))

    def _outlet(self, topic: str, type_name: str) -> Any:
        outlet = self._topics.get(topic)
        if outlet is None:
            # Who navigates asks for reliable odometry; a reliable writer serves the others too.
            is_reliable = topic.startswith("ground_truth/") or topic in (ODOMETRY_TOPIC, "tf")
            qos = STAGE_QOS if is_reliable else SENSOR_QOS
            outlet = self._topics[topic] = self.create_publisher(
                message_class(type_name), topic, qos
            )
        return outlet

    def _command(self, message: Any) -> None:
        try:
            wanted = twist_of(message)
        except Unusable as error:
            self.get_logger().warning(
                f"cmd_vel: {error}: ignored, the last command is kept",
                throttle_duration_sec=WARN_PERIOD,
            )
            return
        # In force from its stamp on, plus controller.delay, however long it was on its way.
        now = self._simulation.stamp_ns
        stamp = stamp_of(message, now, fallback=True)
        is_foreign = abs(stamp - now) > FOREIGN_NS
        self._simulation.command(*wanted, stamp_ns=now if is_foreign else stamp)
        self.get_logger().info(HEARD, once=True)

    def _parameters_set(self, parameters: list[Parameter]) -> None:
        """Take over what the parameter callbacks let through."""
        changed = {split_name(p.name)[0] for p in parameters if p.name in FAULT_PARAMETERS}
        for fault_id in changed:
            self._set_fault(fault_id)
        for parameter in parameters:
            if parameter.name == "real_time_factor":
                self._factor = float(parameter.value)
                self._anchor()

    def _set_fault(self, fault_id: str) -> None:
        settings = {
            split_name(name)[1]: self.get_parameter(name).value
            for name in FAULT_PARAMETERS
            if split_name(name)[0] == fault_id
        }
        self._simulation.faults.set(fault_id, settings)


def _number(values: dict[str, Value], name: str) -> float:
    value = values[name]
    if isinstance(value, str | tuple):
        raise TypeError(f"{name} is no number")
    return float(value)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `sim_bridge`."""
    specs = (*PARAMETERS, *FAULT_PARAMETERS.values())
    given = node_arguments("sim_bridge", DESCRIPTION, specs, EPILOG, arguments)
    # Not only the start may fail: a plant that becomes unstable ends the node as well.
    return run_main(lambda _: run_node(SimBridge, given))
