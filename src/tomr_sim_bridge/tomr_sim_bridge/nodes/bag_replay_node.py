"""Node `bag_replay`: a rosbag2 recording as live topics with /clock, without `ros2 bag`.

Messages go out as the bytes that were recorded, in the recording's order, each when its receive
stamp is due. Topics are published relative to the node's namespace. /clock never runs ahead of a
message that is still to come.
"""

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.leaving import leave
from tomr_power_model.nodes.robot_parameters import declare_specs
from tomr_power_model.nodes.stage_node import StopRequest, message_class
from tomr_power_model.recordings import Recording, open_recording
from tomr_sim_bridge.replay import (
    REPLAY_PARAMETERS,
    PlaybackClock,
    first_stamp_ns,
    select_topics,
)

# Reliable writers serve best-effort readers too; the depth bridges a reader that is slow to answer.
REPLAY_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
LONGEST_SLEEP_NS = 50_000_000  # a signal is noticed within it
POLL_S = 0.02
# A reader that missed a message asks for it within milliseconds, but that all is well it may only
# confirm at the writer's next heartbeat, up to 3 s later: not worth waiting for.
DELIVERY_TIMEOUT_S = 0.5
# A subscriber counted here may itself learn of its new publisher a moment later.
SETTLE_S = 0.2

DESCRIPTION = """\
Replay the sensor topics of a rosbag2 recording (folder, .mcap or .db3) with /clock."""
EPILOG = """\
examples:
  bag_replay --ros-args -p bag:=robotino_bags/gray/exp05
  bag_replay --ros-args -p bag:=run.mcap -p rate:=4.0 -p start_offset:=30.0
  bag_replay --ros-args -p bag:=run -p "topics:=['joint_states', 'wheel_1/power']"

exit codes: 0 at the end of the recording or after SIGINT or SIGTERM; 2 bad input."""


class BagReplay:
    """Publishes a recording in its own time."""

    def __init__(self, node: Node, stopped: Callable[[], bool]) -> None:
        """Publish through `node`; `stopped` returns whether to end early. Raises InputError."""
        self._node = node
        self._log = node.get_logger()
        self._values: dict[str, Any] = dict(declare_specs(node, REPLAY_PARAMETERS))
        self._stopped = stopped
        self._clock_publisher = node.create_publisher(Clock, "/clock", REPLAY_QOS)
        self._outlets: dict[str, Any] = {}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._sent = 0

    def replay(self) -> None:
        """Replay the recording, once or in a loop, until its end or until stopped."""
        values = self._values
        with open_recording(values["bag"]) as recording:
            if recording.warning:
                self._log.warning(recording.warning)
            selected = select_topics(recording, values["topics"], values["include_ground_truth"])
            start_ns = first_stamp_ns(recording, values["start_offset"])
            self._offer(selected)
            self._log.info(
                f"{recording.name}: {', '.join(self._outlets)}; "
                f"{(recording.end_ns - start_ns) / NANOSECONDS:.1f} s at rate {values['rate']:g}"
            )
            self._wait_for_subscribers()
            while not self._stopped():
                self._play(recording, start_ns)
                self._check_progress(recording)
                if not values["loop"]:
                    break
        self._deliver()
        self._log.info(f"{self._sent} messages replayed")

    def _check_progress(self, recording: Recording) -> None:
        if self._sent == 0 and not self._stopped():
            raise InputError(
                f"{recording.name} holds no message of {', '.join(self._outlets)} from "
                f"start_offset = {self._values['start_offset']:g} s on"
            )

    def _offer(self, selected: dict[str, str]) -> None:
        for topic, type_name in selected.items():
            try:
                kind = message_class(type_name)
            except (ImportError, AttributeError, ValueError):
                if self._values["topics"]:
                    raise InputError(
                        f"{topic} has the type {type_name}, which is not installed here; "
                        "leave it out of `topics`"
                    ) from None
                self._log.warning(f"{topic} is left out: {type_name} is not installed")
                continue
            self._outlets[topic] = self._node.create_publisher(kind, topic.lstrip("/"), REPLAY_QOS)
        if not self._outlets:
            raise InputError(f"{self._values['bag']}: none of its message types is installed here")

    def _wait_for_subscribers(self) -> None:
        limit = self._values["wait_for_subscribers"]
        end = time.monotonic() + limit
        waiting = dict(self._outlets)
        while waiting and not self._stopped() and time.monotonic() < end:
            self._serve(POLL_S)
            waiting = {
                topic: outlet
                for topic, outlet in waiting.items()
                if outlet.get_subscription_count() == 0
            }
        if limit > 0.0:
            if waiting and not self._stopped():
                self._log.info(f"nobody listens to {', '.join(waiting)}")
            self._pause_until(time.monotonic_ns() + round(SETTLE_S * NANOSECONDS))

    def _play(self, recording: Recording, start_ns: int) -> None:
        messages = recording.raw_messages(self._outlets, start_ns)
        clock = PlaybackClock(start_ns, time.monotonic_ns(), self._values["rate"])
        period_ns = round(NANOSECONDS / self._values["clock_rate"])
        tick_ns = time.monotonic_ns()
        last_ns = start_ns
        for topic, _, data, stamp_ns in messages:
            while not self._stopped():
                wall_ns = time.monotonic_ns()
                if wall_ns >= tick_ns:
                    tick_ns = wall_ns + period_ns
                    last_ns = max(last_ns, min(clock.now_ns(wall_ns), stamp_ns))
                    self._tick(last_ns)
                    rate = float(self._node.get_parameter("rate").value)
                    if rate != clock.rate:
                        clock.set_rate(rate, wall_ns)
                due_ns = clock.due_ns(stamp_ns)
                if wall_ns >= due_ns:
                    break
                self._pause_until(min(due_ns, tick_ns))
            if self._stopped():
                return
            self._outlets[topic].publish(bytes(data))
            self._sent += 1
            last_ns = max(last_ns, stamp_ns)
        self._tick(last_ns)

    def _tick(self, now_ns: int) -> None:
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now_ns, NANOSECONDS)
        self._clock_publisher.publish(message)
        self._serve(0.0)

    def _serve(self, timeout_s: float) -> None:
        """Answer parameter services."""
        self._executor.spin_once(timeout_sec=timeout_s)

    def _pause_until(self, wall_ns: int) -> None:
        while not self._stopped():
            left_ns = wall_ns - time.monotonic_ns()
            if left_ns <= 0:
                return
            time.sleep(min(left_ns, LONGEST_SLEEP_NS) / NANOSECONDS)

    def _deliver(self) -> None:
        """Let the last messages reach their readers before the publishers go."""
        if self._stopped():
            return
        end = time.monotonic() + DELIVERY_TIMEOUT_S
        for outlet in (*self._outlets.values(), self._clock_publisher):
            outlet.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))
        self._pause_until(time.monotonic_ns() + round(SETTLE_S * NANOSECONDS))


def run_replay(arguments: Sequence[str] | None = None) -> int:
    """Run the node to its end; return its exit code."""
    given = node_arguments("bag_replay", DESCRIPTION, REPLAY_PARAMETERS, EPILOG, arguments)
    stop = StopRequest()
    rclpy.init(args=given, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("bag_replay", automatically_declare_parameters_from_overrides=True)
        try:
            BagReplay(node, lambda: stop.is_set).replay()
        finally:
            leave(node)
    finally:
        rclpy.shutdown()
    return EXIT_OK


def main() -> int:
    """Entry point of `bag_replay`."""
    return run_main(run_replay)


if __name__ == "__main__":
    sys.exit(main())
