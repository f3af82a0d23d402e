"""`tomr_diagnosis` as a managed node: the services of lifecycle_msgs, called as a manager does."""

import signal
from collections.abc import Callable, Iterator
from importlib.resources import files
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from tomr_fault_diag.classifier.messages import NAME

ROBOT = str(files("tomr_power_model").joinpath("robots").joinpath("reference.yaml"))
HEARD = ("joint_states", "cmd_vel", "wheel_1/power", "wheel_2/power", "wheel_3/power")
OFFERED = ("/diagnostics", "residuals")
T = Transition


class Manager:
    """Asks for transitions, and hears what the node says."""

    def __init__(self) -> None:
        self.node = Node("manager")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self.said: list[str] = []
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 100)

    def _hear(self, message: DiagnosticArray) -> None:
        self.said += [status.message for status in message.status if status.name == NAME]

    def spin(self) -> bool:
        self._executor.spin_once(0.02)
        return True

    def hears_that_it_waits(self) -> bool:
        """On a busy machine samples may be late at first."""
        self.spin()
        return any(words.startswith("waiting") for words in self.said)

    def ask(self, kind: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(20.0)
        answer = client.call_async(request)
        self._executor.spin_until_future_complete(answer, timeout_sec=20.0)
        assert answer.done()
        return answer.result()

    def change(self, number: int) -> tuple[bool, str]:
        """Whether a transition succeeded, and the state after it."""
        request = ChangeState.Request(transition=T(id=number))
        success = self.ask(ChangeState, "/tomr_diagnosis/change_state", request).success
        answer = self.ask(GetState, "/tomr_diagnosis/get_state", GetState.Request())
        return success, answer.current_state.label

    def connections(self) -> tuple[set[int], set[int]]:
        """How many listen to the inputs, and how many publish what the node offers."""
        self.spin()
        return (
            {self.node.count_subscribers(topic) for topic in HEARD},
            {self.node.count_publishers(topic) for topic in OFFERED},
        )


@pytest.fixture
def manager() -> Iterator[Manager]:
    rclpy.init()
    made = Manager()
    yield made
    made.node.destroy_node()
    rclpy.shutdown()


def test_a_manager_has_the_node_in_hand(
    manager: Manager, spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    def connected(heard: int, offered: int) -> None:
        wait_until(
            lambda: manager.connections() == ({heard}, {offered}), f"{heard} heard, {offered} named"
        )

    ros = ["--ros-args", "--params-file", ROBOT]
    node = spawn(["tomr_diagnosis", *ros, "-p", "managed:=true", "-p", "report_period:=0.05"])
    assert manager.change(T.TRANSITION_ACTIVATE) == (False, "unconfigured")
    connected(0, 0)
    assert manager.change(T.TRANSITION_CONFIGURE) == (True, "inactive")
    connected(0, 1)
    assert manager.change(T.TRANSITION_CONFIGURE) == (False, "inactive")
    assert manager.change(99) == (False, "inactive")
    answer = manager.ask(Trigger, "/tomr_diagnosis/clear", Trigger.Request())
    assert answer.message == "no fault was named"
    spawn(["sim_bridge", *ros])
    for _ in range(2):
        assert manager.change(T.TRANSITION_ACTIVATE) == (True, "active")
        manager.said.clear()
        wait_until(manager.hears_that_it_waits, "a diagnosis")
        assert manager.change(T.TRANSITION_DEACTIVATE) == (True, "inactive")
        # sim_bridge listens to commands.
        wait_until(lambda: manager.connections()[0] == {0, 1}, "nobody listens")
        assert manager.node.count_subscribers("joint_states") == 0
    assert manager.change(T.TRANSITION_CLEANUP) == (True, "unconfigured")
    wait_until(lambda: manager.connections()[1] == {0}, "nothing is offered")
    assert manager.change(T.TRANSITION_CONFIGURE) == (True, "inactive")
    assert manager.change(T.TRANSITION_ACTIVATE) == (True, "active")
    assert manager.change(T.TRANSITION_ACTIVE_SHUTDOWN) == (True, "finalized")
    wait_until(lambda: manager.connections()[1] == {0}, "nothing is offered")
    node.signal(signal.SIGINT, group=True)
    assert node.wait(10.0) == 0
    assert "Traceback" not in node.output
