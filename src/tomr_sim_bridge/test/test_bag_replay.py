"""bag_replay: another process receives what was recorded, byte for byte and in order."""

import signal
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, JointState

from tomr_power_model.cli import run_main
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message, jazzy_typestore
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_sim_bridge.nodes.bag_replay_node import run_replay
from tomr_sim_bridge.replay import PlaybackClock, first_stamp_ns, select_topics

START_NS = 1_700_000_000_000_000_000
STEP_NS = 10_000_000
COUNT = 200
LAST_NS = START_NS + (COUNT - 1) * STEP_NS
BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
SLIP = ("slip", "odom_slip", "floor_traction")  # of the odometry
TYPES = {"joint_states": JointState, "wheel_1/power": BatteryState}


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Two seconds: encoders at 100 Hz, power at 50 Hz, and topics that are not to be replayed."""
    path = tmp_path / "bag"
    with RecordingWriter(path) as writer:
        for index in range(COUNT):
            stamp_ns = START_NS + index * STEP_NS
            header = bag_header(stamp_ns)
            joint = bag_message(
                "sensor_msgs/msg/JointState",
                header=header,
                name=["wheel_1_joint"],
                position=[0.01 * index],
            )
            writer.write("joint_states", "sensor_msgs/msg/JointState", joint, stamp_ns)
            power = bag_message("sensor_msgs/msg/BatteryState", header=header, current=-0.1 * index)
            if index % 2:
                writer.write("wheel_1/power", "sensor_msgs/msg/BatteryState", power, stamp_ns)
            for topic in ("wheel_1/power/predicted", "ground_truth/power", *SLIP):
                writer.write(topic, "sensor_msgs/msg/BatteryState", power, stamp_ns)
    return path


def recorded(path: Path, topic: str) -> list[bytes]:
    """Serialised messages of a topic; on its way DDS fills each up with zeros to whole words."""
    with open_recording(path) as recording:
        return [data + bytes(-len(data) % 4) for _, _, data, _ in recording.raw_messages([topic])]


class Listener:
    """Subscribes in this process to what the replaying process publishes."""

    def __init__(self, context: Context, namespace: str = "") -> None:
        self.node = Node("listener", context=context)
        # Takes messages in the order of their arrival. A wait set takes one of each topic in turn:
        # the clock would be rounds ahead of topics that a busy machine has heaped up.
        self._executor = EventsExecutor(context=context)
        self._executor.add_node(self.node)
        self.raw: dict[str, list[bytes]] = {}
        self.clock: list[int] = []
        for topic, kind in TYPES.items():
            qos = RELIABLE if topic == "joint_states" else BEST_EFFORT
            name = f"{namespace}/{topic}"
            self.raw[topic] = []
            self.node.create_subscription(kind, name, self.raw[topic].append, qos, raw=True)
        self.node.create_subscription(Clock, "/clock", self._take_clock, BEST_EFFORT)

    def _take_clock(self, message: Clock) -> None:
        self.clock.append(message.clock.sec * 1_000_000_000 + message.clock.nanosec)

    def spin_until(self, condition: Callable[[], Any], what: str, timeout: float = 30.0) -> None:
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"not within {timeout:g} s: {what}")
            self._executor.spin_once(timeout_sec=0.02)

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def context() -> Iterator[Context]:
    made = Context()
    rclpy.init(context=made)
    yield made
    rclpy.shutdown(context=made)


@pytest.fixture
def listener(context: Context) -> Iterator[Listener]:
    made = Listener(context)
    yield made
    made.close()


def command(path: Path, *more: str, **parameters: object) -> list[str]:
    given = {"bag": path, **parameters}
    words = [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]
    module = "tomr_sim_bridge.nodes.bag_replay_node"
    return [sys.executable, "-m", module, "--ros-args", *words, *more]


def test_all_messages_arrive_in_order_with_equal_bytes(
    bag: Path, listener: Listener, spawn: Callable[..., Any]
) -> None:
    replay = spawn(command(bag, rate=4.0, wait_for_subscribers=20.0, clock_rate=50.0))
    listener.spin_until(lambda: listener.raw["joint_states"], "the first message")
    first = time.monotonic()
    names = dict(listener.node.get_topic_names_and_types())
    listener.spin_until(lambda: LAST_NS in listener.clock, "the end of the recording")
    assert time.monotonic() - first > 0.8 * (LAST_NS - START_NS) * 1e-9 / 4.0
    expected = {topic: recorded(bag, topic) for topic in TYPES}
    listener.spin_until(
        lambda: all(len(listener.raw[topic]) >= len(expected[topic]) for topic in TYPES),
        "all messages",
    )
    assert replay.wait() == 0, replay.output
    assert listener.raw == expected
    assert "/wheel_1/power/predicted" not in names
    assert not {f"/{topic}" for topic in SLIP} & set(names)
    assert "/ground_truth/power" not in names
    assert (listener.clock[0], listener.clock[-1]) == (START_NS, LAST_NS)
    assert all(before <= after for before, after in pairwise(listener.clock))
    assert len(listener.clock) > 10  # a busy computer leaves some out
    assert f"{COUNT + COUNT // 2} messages replayed" in replay.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_loop_jumps_back_and_ends_cleanly_on_a_signal(
    bag: Path, listener: Listener, spawn: Callable[..., Any], number: signal.Signals
) -> None:
    replay = spawn(command(bag, rate=10.0, loop="true", start_offset=1.0))
    per_round = COUNT // 2
    received = listener.raw["joint_states"]
    listener.spin_until(lambda: len(received) > 2.5 * per_round, "the third round")
    assert received[per_round : 2 * per_round] == received[:per_round]
    assert received[:per_round] == recorded(bag, "joint_states")[per_round:]
    jumps = [after - before for before, after in pairwise(listener.clock) if after < before]
    assert len(jumps) in (1, 2)
    assert set(jumps) == {jumps[0]}
    assert listener.clock[0] == START_NS + 1_000_000_000
    replay.signal(number, group=True)
    replay.signal(number, group=True)
    assert replay.wait(10.0) == 0
    assert "Traceback" not in replay.output


def test_chosen_topics_go_to_the_namespace_and_the_rate_changes_on_the_way(
    bag: Path, context: Context, spawn: Callable[..., Any]
) -> None:
    listener = Listener(context, "/robot1")
    replay = spawn(
        command(
            bag,
            "-r",
            "__ns:=/robot1",
            rate=0.01,
            topics="['wheel_1/power', 'ground_truth/power']",
            wait_for_subscribers=0.0,
        )
    )
    client = listener.node.create_client(SetParameters, "/robot1/bag_replay/set_parameters")
    listener.spin_until(lambda: listener.clock and client.service_is_ready(), "the node")
    names = dict(listener.node.get_topic_names_and_types())
    assert "/robot1/ground_truth/power" in names
    rate = Parameter("rate", Parameter.Type.DOUBLE, -1.0).to_parameter_msg()
    refused = client.call_async(SetParameters.Request(parameters=[rate]))
    listener.spin_until(refused.done, "the answer")
    assert not refused.result().results[0].successful
    rate = Parameter("rate", Parameter.Type.DOUBLE, 20.0).to_parameter_msg()
    taken = client.call_async(SetParameters.Request(parameters=[rate]))
    listener.spin_until(taken.done, "the answer")
    assert taken.result().results[0].successful
    listener.spin_until(lambda: replay.popen.poll() is not None, "the end of the replay")
    assert replay.wait() == 0
    last = recorded(bag, "wheel_1/power")[-1]
    listener.spin_until(lambda: last in listener.raw["wheel_1/power"], "the last message")
    assert listener.raw["joint_states"] == []
    listener.close()


@pytest.mark.parametrize(
    ("parameters", "part"),
    [
        ({"bag": "absent"}, "absent does not exist"),
        ({"rate": "0.0"}, "rate = 0"),
        ({"rate": "fast"}, "give a number"),
        ({"start_offset": "9.5"}, "beyond the end"),
        ({"topics": "['odom']"}, "no topic /odom"),
        ({}, "bag is missing"),
    ],
)
def test_bad_input_gets_one_line(
    bag: Path, capfd: pytest.CaptureFixture[str], parameters: dict[str, str], part: str
) -> None:
    given = {"bag": bag, **parameters} if parameters else {}
    words = [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]
    assert run_main(run_replay, ["--ros-args", *words]) == 2
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "error" in line]
    assert part in line


def test_a_recording_that_ends_in_damage_is_replayed_up_to_there(
    tmp_path: Path, listener: Listener, spawn: Callable[..., Any]
) -> None:
    path = tmp_path / "damaged"
    type_name = "sensor_msgs/msg/JointState"
    noise = np.random.default_rng(1)
    with RecordingWriter(path) as writer:
        for index in range(3):
            message = bag_message(type_name, header=bag_header(index), effort=noise.random(2**17))
            data = jazzy_typestore().serialize_cdr(message, type_name)
            writer.write_raw("joint_states", type_name, data, index)
    file = next(path.glob("*.mcap"))
    content = file.read_bytes()
    frame = b"\x28\xb5\x2f\xfd"
    last = content.rindex(frame)
    file.write_bytes(content[:last] + bytes(4) + content[last + 4 :])
    replay = spawn(command(path, wait_for_subscribers=20.0))
    listener.spin_until(lambda: replay.popen.poll() is not None, "the end of the replay")
    assert replay.wait() == 2
    assert f"error: {path}: message" in replay.output
    assert "Traceback" not in replay.output


def test_a_playback_clock_changes_its_rate_without_a_jump() -> None:
    clock = PlaybackClock(1_000, 50, 2.0)
    assert clock.now_ns(50) == 1_000
    assert clock.now_ns(150) == 1_200
    assert clock.due_ns(1_200) == 150
    clock.set_rate(0.5, 150)
    assert clock.now_ns(150) == 1_200
    assert clock.now_ns(350) == 1_300
    assert clock.due_ns(1_300) == 350


def test_what_is_replayed_by_default(bag: Path) -> None:
    with open_recording(bag) as recording:
        assert list(select_topics(recording, (), False)) == ["/joint_states", "/wheel_1/power"]
        assert "/ground_truth/power" in select_topics(recording, (), True)
        assert list(select_topics(recording, ("power/predicted",), False)) == [
            "/wheel_1/power/predicted"
        ]
        assert first_stamp_ns(recording, 0.5) == START_NS + 500_000_000
        assert first_stamp_ns(recording, 1.99) == LAST_NS
        with pytest.raises(InputError, match=r"lasts 1\.99 s"):
            first_stamp_ns(recording, 2.0)
