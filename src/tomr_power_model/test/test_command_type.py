"""Which type of cmd_vel a node listens to, by the types of its publishers."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tomr_power_model.messages.types import TWIST, TWIST_STAMPED
from tomr_power_model.nodes.command_type import CommandType, chosen_type


@pytest.mark.parametrize(
    ("current", "found", "chosen"),
    [
        (TWIST_STAMPED, set(), TWIST_STAMPED),
        (TWIST_STAMPED, {TWIST}, TWIST),
        (TWIST, {TWIST_STAMPED}, TWIST_STAMPED),
        # Where both are there, it stays: no flapping.
        (TWIST, {TWIST, TWIST_STAMPED}, TWIST),
        (TWIST_STAMPED, {TWIST, TWIST_STAMPED}, TWIST_STAMPED),
        (TWIST_STAMPED, {"std_msgs/msg/String"}, TWIST_STAMPED),
    ],
)
def test_the_type_that_publishers_have(current: str, found: set[str], chosen: str) -> None:
    assert chosen_type(current, found) == chosen


class Graph:
    """A node's view of the publishers of cmd_vel, without ROS."""

    def __init__(self, setting: str) -> None:
        self.types: set[str] = set()
        self.heard: list[str] = []
        self.warned: list[str] = []
        self.look: Any = None
        self._listening = CommandType(cast("Any", self), "cmd_vel", setting, self._subscribe)

    def _subscribe(self, type_name: str) -> str:
        self.heard.append(type_name)
        return type_name

    def destroy_subscription(self, subscription: str) -> None:
        self.heard.remove(subscription)

    def create_timer(self, period: float, callback: Any, clock: Any) -> None:
        self.look = callback

    def destroy_timer(self, timer: Any) -> None:
        self.look = None

    def resolve_topic_name(self, topic: str) -> str:
        return f"/{topic}"

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        return [SimpleNamespace(topic_type=name) for name in sorted(self.types)]

    def get_logger(self) -> Any:
        return SimpleNamespace(info=lambda _: None, warning=self.warned.append)

    def close(self) -> None:
        self._listening.close()


def test_it_changes_to_the_type_that_is_published() -> None:
    graph = Graph("auto")
    first = graph.heard[0]
    graph.types = {TWIST if first == TWIST_STAMPED else TWIST_STAMPED}
    graph.look()
    assert graph.heard == []  # one look in between: a participant has a topic in one type
    graph.look()
    assert set(graph.heard) == graph.types
    assert graph.warned == []
    graph.close()
    assert (graph.heard, graph.look) == ([], None)


def test_a_type_that_is_not_heard_is_reported_once() -> None:
    graph = Graph("twist")
    graph.types = {TWIST_STAMPED}
    for _ in range(3):
        graph.look()
    assert graph.heard == [TWIST]
    assert len(graph.warned) == 1
    assert f"published as {TWIST_STAMPED}, which is not heard" in graph.warned[0]
