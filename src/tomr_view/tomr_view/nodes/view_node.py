"""Node `tomr_view`: hears residuals and diagnosis, and hands pictures to the web server."""

import queue
from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient

from tomr_fault_diag.classifier.messages import NAME
from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_fault_diag.diagnosis.labels import TRUTH_TOPIC
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_fault_diag.residuals.messages import frame_of
from tomr_power_model.errors import InputError
from tomr_power_model.messages.intake import MALFORMED, stamp_of
from tomr_power_model.nodes.stage_node import STAGE_QOS, run_node
from tomr_power_model.robot import Robot, load_robot
from tomr_sim_bridge.faults import all_parameters, check_settings, fault_ids
from tomr_view.picture import Gatherer, Json, Status, described, fault_buttons
from tomr_view.server import Server

PERIOD = 0.1  # s between two pictures
KEPT = 600  # pictures: a minute
_SIMULATOR = "sim_bridge"
_MOST_WAITING = 16  # commands


class ViewNode(Node):
    """Gathers what is published of one robot, that of its namespace."""

    def __init__(self, robot: Robot, host: str, port: int) -> None:
        super().__init__("tomr_view")
        self._gatherer = Gatherer(robot)
        self._prefix = self.get_namespace().rstrip("/")
        self._commands: queue.Queue[Json] = queue.Queue(_MOST_WAITING)
        self._shown_ns = 0
        hello = {"mode": "live", "title": self._prefix or "live", "robot": described(robot)}
        self._server = Server({**hello, "faults": []}, kept=KEPT, command=self._wish)
        self._server.start(host, port)
        self.get_logger().info(f"watch at {self._server.address}")
        for topic, take in (
            (RESIDUALS, self._residuals),
            (DIAGNOSTICS, self._diagnosis),
            (TRUTH_TOPIC, self._truth),
        ):
            self._listen(topic, take)
        self._simulator = AsyncParameterClient(self, _SIMULATOR)
        self._can_fail = False
        self.create_timer(PERIOD, self._show, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _listen(self, topic: str, take: Any) -> None:
        def receive(message: Any) -> None:
            try:
                take(message, stamp_of(message, self.get_clock().now().nanoseconds))
            except MALFORMED as error:
                self.get_logger().warning(f"{topic}: {error}: ignored", throttle_duration_sec=10.0)

        self.create_subscription(DiagnosticArray, topic, receive, STAGE_QOS)

    def _residuals(self, message: Any, stamp_ns: int) -> None:
        self._gatherer.residuals(frame_of(message, stamp_ns))

    def _diagnosis(self, message: Any, _: int) -> None:
        """/diagnostics is everybody's: ours are named for the namespace."""
        statuses = map(Status.of_message, message.status)
        mine = [s for s in statuses if self._is_mine(s.name)]
        self._gatherer.diagnosis(mine)

    def _is_mine(self, name: str) -> bool:
        prefix = f"{self._prefix}/" if self._prefix else ""
        return name == prefix + NAME or name.startswith(f"{prefix}inputs: ")

    def _truth(self, message: Any, stamp_ns: int) -> None:
        self._gatherer.truth(map(Status.of_message, message.status), stamp_ns)

    def _show(self) -> None:
        """A picture, if there is a new one; the wishes of pages; whether there is a simulator."""
        frame = self._gatherer.frame
        if frame is not None and frame.stamp_ns != self._shown_ns:
            self._shown_ns = frame.stamp_ns
            picture = self._gatherer.picture()
            if picture is not None:
                self._server.show(picture)
        can_fail = bool(self._simulator.services_are_ready())
        if can_fail != self._can_fail:
            self._can_fail = can_fail
            self._server.update(faults=fault_buttons() if can_fail else [])
        while not self._commands.empty():
            self._set_fault(self._commands.get_nowait())

    def _wish(self, asked: Json) -> None:
        """Called by the server's thread; what is too much is dropped."""
        try:
            self._commands.put_nowait(asked)
        except queue.Full:
            return

    def _set_fault(self, asked: Json) -> None:
        """Bring a fault of the simulator, or take all away for an id of null."""
        if not self._can_fail:
            return
        values: dict[str, object] = {f"faults.{name}.severity": 0.0 for name in fault_ids()}
        fault_id = asked.get("id")
        if fault_id is not None:
            try:
                settings = {k: v for k, v in asked.items() if k in ("wheel", "severity")}
                checked = check_settings(str(fault_id), settings, "page")
            except InputError as error:
                self.get_logger().warning(str(error), throttle_duration_sec=10.0)
                return
            values |= {f"faults.{fault_id}.{name}": value for name, value in checked.items()}
        known = all_parameters()
        wanted = [Parameter(name, value=value) for name, value in values.items() if name in known]
        self._simulator.set_parameters_atomically(wanted)

    def destroy_node(self) -> None:
        """Leave the graph and the web."""
        self._server.close()
        super().destroy_node()


def view_live(robot: str, host: str, port: int, ros_arguments: Sequence[str]) -> int:
    """Serve what runs now until a signal; returns the exit code."""
    given = ["tomr_view", *ros_arguments]
    return run_node(lambda: ViewNode(load_robot(robot), host, port), given)
