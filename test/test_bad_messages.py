"""Three nodes over DDS, fed with bad messages amid good ones: they go on and say nothing wrong."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import files
from typing import Any

import rclpy
from attrs import define, field, frozen
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TwistStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, JointState

from tomr_fault_diag.classifier.messages import NAME
from tomr_fault_diag.residuals.frame import residual_names
from tomr_power_model.messages.outgoing import JointMessage
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.nodes.stage_node import STAGE_QOS
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.predictions import prediction_topics

ROBOT = shipped_robot("reference")
ROBOT_FILE = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
WHEELS = ROBOT.wheel_names
POWER = tuple(f"{topic}/power" for topic in ROBOT.wheel_topics)
NAMES = residual_names(ROBOT.wheel_topics)
TOTAL, SPEEDS, DERIVED = NAMES[0], NAMES[4:7], NAMES[7:]
FRAME = len(NAMES) + 6  # and what an IMU and the drivers say

NODES = ("power_model", "power_residuals", "fault_classifier")
ROUND = 20_000_000  # ns: encoders and power come at 50 Hz
ROUNDS_PER_STEP = 5  # published at a stroke: less than the nodes' patience with a silent stream
TICK = 50_000_000  # ns, of decision_rate
SETTLE = 20_000_000  # ns, settle_time
HOLD = 0.3  # s to wait for the answer to a step before the next one
ANGLES = (1.0, 2.0, 3.0)  # rad: differ, so that a mix-up of wheels is a jump
VOLTAGE = 24.0
STANDBY = 1.2  # W per motor
STANDING = 15.6  # W: three drivers in standby, computer and sensors

NAN, INF = float("nan"), float("inf")


def _stamp(stamp_ns: int) -> Time:
    return Time(sec=stamp_ns // NANOSECONDS, nanosec=stamp_ns % NANOSECONDS)


def _stamped(message: Any, stamp_ns: int) -> Any:
    message.header.stamp = _stamp(stamp_ns)
    return message


def _joints(
    positions: Sequence[float] = ANGLES,
    names: Sequence[str] = WHEELS,
    velocities: Sequence[float] = (0.0, 0.0, 0.0),
) -> JointState:
    return JointState(name=list(names), position=list(positions), velocity=list(velocities))


def _supply(power: float, voltage: float = VOLTAGE) -> BatteryState:
    return BatteryState(voltage=voltage, current=-power / VOLTAGE)


def _twist(x: float = 0.0) -> TwistStamped:
    message = TwistStamped()
    message.twist.linear.x = x
    return message


def _frame(count: int = FRAME, values: Sequence[tuple[str, str]] = ()) -> DiagnosticArray:
    pairs = [KeyValue(key=key, value=value) for key, value in values]
    status = DiagnosticStatus(level=DiagnosticStatus.OK, message="as modelled: 0 W", values=pairs)
    return DiagnosticArray(status=[status] * count)


@frozen
class Seen:
    """One message of residuals: what is stale, with the reason, and what is out of its band."""

    stamp_ns: int
    stale: dict[str, str]
    outside: tuple[str, ...]

    @classmethod
    def of(cls, message: DiagnosticArray) -> "Seen":
        values = {s.name: {item.key: item.value for item in s.values} for s in message.status}
        return cls(
            _stamp_ns(message),
            {s.name: s.message for s in message.status if s.level == DiagnosticStatus.STALE},
            tuple(name for name, pairs in values.items() if pairs["code"] != "0"),
        )


@define
class Bench:
    """A robot that stands still, played by this test, and what the nodes say of it."""

    node: Node
    executor: SingleThreadedExecutor
    wait_until: Callable[..., Any]
    now: int
    wheels: tuple[str, ...] = WHEELS
    frames: list[Seen] = field(factory=list)
    states: list[tuple[int, str]] = field(factory=list)  # stamp, headline
    outlets: dict[str, Any] = field(factory=dict)
    processes: dict[str, Any] = field(factory=dict)

    def send(self, topic: str, message: Any, stamp_ns: int | None = None) -> None:
        """Publish a message, stamped now if nothing else is said."""
        if topic not in self.outlets:
            kind = type(message)
            self.outlets[topic] = self.node.create_publisher(kind, topic, STAGE_QOS)
        self.outlets[topic].publish(_stamped(message, self.now if stamp_ns is None else stamp_ns))

    def until(self, condition: Callable[[], bool], what: str, timeout: float = 20.0) -> None:
        """Play on, a step at a time, until the condition holds."""

        def holds() -> bool:
            self._step()
            for name, process in self.processes.items():
                assert process.popen.poll() is None, f"{name} ended, waiting for: {what}"
            return condition()

        self.wait_until(holds, what, timeout)

    def _step(self) -> None:
        """A tenth of a second of good messages, and the answer to it if there is one."""
        for _ in range(ROUNDS_PER_STEP):
            self.now += ROUND
            if self.now // ROUND % 5 == 0:
                self.send("cmd_vel", _twist())
            angles = [ANGLES[WHEELS.index(name)] for name in self.wheels]
            self.send("joint_states", _joints(angles, self.wheels, [0.0] * len(angles)))
            for topic in POWER:
                self.send(topic, _supply(STANDBY))
            self.send("battery_state", _supply(STANDING))
        limit = time.monotonic() + HOLD
        while not self.is_answered() and time.monotonic() < limit:
            self.executor.spin_once(0.02)

    def is_answered(self) -> bool:
        """Whether the newest decision that is due has come."""
        due = (self.now - SETTLE) // TICK * TICK
        return bool(self.frames and self.states) and (
            self.frames[-1].stamp_ns == due == self.states[-1][0]
        )

    def is_sound(self, since: int) -> bool:
        """Whether the last three decisions found all as modelled and no fault."""
        last = self.frames[since:][-3:]
        found = [state for _, state in self.states[-3:]]
        sound = all(not frame.stale and not frame.outside for frame in last)
        return self.is_answered() and len(last) == 3 and sound and all(map(_quiet, found))


def _quiet(headline: str) -> bool:
    """Whether no fault is named: this robot stands still, and a fault could hide in that."""
    return headline.startswith(("normal", "not observable in this motion"))


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


@contextmanager
def _bench(wait_until: Callable[..., Any]) -> Iterator[Bench]:
    rclpy.init()
    node, executor = Node("bench"), SingleThreadedExecutor()
    executor.add_node(node)
    bench = Bench(node, executor, wait_until, time.time_ns() // ROUND * ROUND)

    def note(message: DiagnosticArray) -> None:
        drive = [status for status in message.status if status.name == NAME]
        bench.states.extend((_stamp_ns(message), status.message) for status in drive)

    def keep(message: DiagnosticArray) -> None:
        if len(message.status) == FRAME and message.status[0].name == TOTAL:
            bench.frames.append(Seen.of(message))

    node.create_subscription(DiagnosticArray, "/diagnostics", note, STAGE_QOS)
    node.create_subscription(DiagnosticArray, "residuals", keep, STAGE_QOS)
    try:
        yield bench
    finally:
        node.destroy_node()
        rclpy.shutdown()


@frozen
class Case:
    """A disturbance; the node that must complain of it, and in which words."""

    disturb: Callable[[Bench], None]
    node: str = ""
    words: str = ""
    stale: bool = False  # whether residuals may be STALE for a moment


def _sends(
    topic: str, make: Callable[[], Any], stamp: Callable[[int], int] = lambda now: now + ROUND // 2
) -> Callable[[Bench], None]:
    return lambda bench: bench.send(topic, make(), stamp(bench.now))


def _jump(seconds: float) -> Callable[[Bench], None]:
    def jump(bench: Bench) -> None:
        bench.now += round(seconds * NANOSECONDS)

    return jump


def _broken_predictions(bench: Bench) -> None:
    """A whole set of one stamp, whose arrays are too short."""
    for topic, kind in prediction_topics(ROBOT).items():
        short = JointState(name=list(WHEELS), velocity=[0.0, 0.0], effort=[0.0])
        message = short if kind is JointMessage else _supply(STANDBY)
        bench.send(topic, message, bench.now + 1)


REORDERED = ("wheel_3_joint", "gripper_joint", "wheel_1_joint", "wheel_2_joint")
CASES = {
    "angles NaN": Case(_sends("joint_states", lambda: _joints([NAN] * 3, WHEELS, [NAN] * 3))),
    "angle infinite": Case(_sends("joint_states", lambda: _joints((1.0, INF, 3.0)))),
    "angles too few": Case(
        _sends("joint_states", lambda: _joints((1.0, 2.0))), "power_model", "3 names but 2 values"
    ),
    "speeds too many": Case(
        _sends("joint_states", lambda: _joints(velocities=(9.0,) * 4)),
        "power_residuals",
        "3 names but 4 values in velocity",
    ),
    "no joints": Case(_sends("joint_states", JointState), "power_residuals", "but no joint"),
    "other joints only": Case(_sends("joint_states", lambda: _joints(names=("a", "b", "c")))),
    "names reordered": Case(
        _sends("joint_states", lambda: _joints((3.0, 9.0, 1.0, 2.0), REORDERED, [0.0] * 4))
    ),
    "joints without a stamp": Case(
        _sends("joint_states", lambda: _joints((9.0,) * 3), lambda _: 0),
        "power_model",
        "joint_states: the stamp has no stamp",
    ),
    "joints again": Case(
        _sends("joint_states", lambda: _joints((9.0,) * 3), lambda now: now),
        "power_residuals",
        "joint_states: the stamp repeats",
    ),
    "joints late": Case(
        _sends("joint_states", lambda: _joints((9.0,) * 3), lambda now: now - 10 * ROUND),
        "power_model",
        "joint_states: the stamp repeats",
    ),
    "current NaN": Case(
        _sends(POWER[0], lambda: BatteryState(voltage=VOLTAGE, current=NAN)),
        "power_residuals",
        "wheel_1/power: the current is not finite",
    ),
    "current infinite": Case(
        _sends(POWER[1], lambda: BatteryState(voltage=VOLTAGE, current=-INF)),
        "power_residuals",
        "wheel_2/power: the current is not finite",
    ),
    "voltage NaN": Case(_sends(POWER[2], lambda: _supply(99.0, NAN))),
    "supply voltage NaN": Case(
        _sends("battery_state", lambda: _supply(99.0, NAN)), "power_residuals", "battery_state: "
    ),
    "power without a stamp": Case(
        _sends(POWER[0], lambda: _supply(999.0), lambda _: 0), "power_residuals", "no stamp"
    ),
    "power again": Case(_sends(POWER[1], lambda: _supply(999.0), lambda now: now)),
    "power late": Case(_sends(POWER[2], lambda: _supply(999.0), lambda now: now - 5 * ROUND)),
    "twist NaN": Case(_sends("cmd_vel", lambda: _twist(NAN)), "power_model", "not finite"),
    "twist infinite": Case(_sends("cmd_vel", lambda: _twist(INF)), "power_model", "not finite"),
    "predictions too short": Case(_broken_predictions, stale=True),
    "residuals too few": Case(
        _sends("residuals", lambda: _frame(9)),
        "fault_classifier",
        f"9 statuses, a frame has {FRAME}",
    ),
    "residuals without numbers": Case(_sends("residuals", _frame), "fault_classifier", "no number"),
    "residuals in words": Case(
        _sends("residuals", lambda: _frame(values=[("residual", "big"), ("band", "1")])),
        "fault_classifier",
        "no number",
    ),
    "one stamp far ahead": Case(
        _sends("joint_states", _joints, lambda _: 2**31 * NANOSECONDS - 1),
        "power_model",
        "jumps",
        stale=True,
    ),
    "clock leaps": Case(_jump(100.0), "power_residuals", "jumps", stale=True),
    "clock goes back": Case(_jump(-300.0), "power_residuals", "jumps", stale=True),
    "clock goes back a little": Case(_jump(-0.3), stale=True),
    "clock leaps a little": Case(_jump(0.4), stale=True),
}


def _disturb(bench: Bench, name: str, case: Case) -> None:
    since, said = len(bench.frames), len(bench.states)
    case.disturb(bench)
    bench.until(lambda: bench.is_sound(since), f"all is well again after: {name}")
    for frame in bench.frames[since:]:
        assert not frame.outside, (name, frame)
        assert case.stale or not frame.stale, (name, frame)
    for _, state in bench.states[said:]:
        # A stage that starts afresh waits for its next command.
        lost = state.startswith(("stale", "waiting", "not enough data"))
        assert _quiet(state) or (case.stale and lost), (name, state)
    if case.node:
        bench.processes[case.node].wait_for_output(case.words)


def _lose_a_wheel(bench: Bench) -> None:
    """Power derived from encoders needs the motion of the body, thus all three wheels."""
    bench.wheels = (WHEELS[0], WHEELS[2])
    bench.until(lambda: SPEEDS[1] in bench.frames[-1].stale, "a wheel is missed")
    since = len(bench.frames)
    bench.until(lambda: len(bench.frames) >= since + 20, "decisions without it")
    for frame in bench.frames[since:]:
        assert SPEEDS[1] in frame.stale
        assert set(frame.stale) <= {SPEEDS[1], *DERIVED}, frame
        assert "joint_states" in frame.stale[SPEEDS[1]]
        assert not frame.outside, frame
    assert _quiet(bench.states[-1][1])
    bench.processes["power_model"].wait_for_output("no wheel_2_joint among its names")
    bench.wheels = WHEELS
    bench.until(lambda: bench.is_sound(since), "all is well with three wheels")


def _restart_the_model(bench: Bench, spawn: Callable[[str], Any]) -> None:
    since = len(bench.frames)
    assert bench.processes.pop("power_model").stop() == 0
    bench.until(lambda: len(bench.frames[-1].stale) == len(NAMES), "nothing to compare")
    reasons = set(bench.frames[-1].stale.values())
    assert reasons == {"no prediction: power_model does not run, or waits for what it reads"}
    bench.until(lambda: bench.states[-1][1].startswith("stale: no prediction"), "stale state")
    bench.processes["power_model"] = spawn("power_model")
    bench.until(lambda: bench.is_sound(since), "all is well after the restart", timeout=30.0)
    assert not any(frame.outside for frame in bench.frames[since:])


def test_nodes_survive_bad_messages_and_a_restart(
    spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    def start(name: str) -> Any:
        prompt = ["-p", "report_period:=0.05"] if name == "fault_classifier" else []
        return spawn([name, "--ros-args", "--params-file", str(ROBOT_FILE), *prompt])

    with _bench(wait_until) as bench:
        bench.processes.update({name: start(name) for name in NODES})
        bench.until(lambda: bench.is_sound(0), "all is well", timeout=30.0)
        for name, case in CASES.items():
            _disturb(bench, name, case)
        _lose_a_wheel(bench)
        _restart_the_model(bench, start)
