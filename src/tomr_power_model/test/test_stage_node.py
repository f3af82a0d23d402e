"""What all nodes do besides passing messages on."""

from types import SimpleNamespace
from typing import Any

import pytest

from tomr_power_model.nodes.stage_node import StageNode

ROBOT = ("tomr_diagnosis", "/")


def _node(others: dict[str, int], twins: int) -> tuple[Any, list[tuple[str, str]]]:
    """A node that publishes two topics, so many others of the first's name and on its topics."""
    said: list[tuple[str, str]] = []
    node = SimpleNamespace(
        get_name=lambda: ROBOT[0],
        get_namespace=lambda: ROBOT[1],
        get_node_names_and_namespaces=lambda: [ROBOT] * (1 + twins) + [("other", "/")],
        count_publishers=lambda topic: 1 + others.get(topic, 0),
        complain=lambda topic, problem: said.append((topic, problem)),
        _outlets={"residuals": None, "/diagnostics": None},
        _rivals={},
    )
    return node, said


@pytest.mark.parametrize(
    ("others", "twins", "expected"),
    [
        ({}, 0, []),
        ({"/diagnostics": 3}, 0, []),  # which robots share
        ({"residuals": 1}, 0, ["residuals"]),
        ({"residuals": 1}, 1, ["tomr_diagnosis"]),
    ],
)
def test_a_second_diagnosis_of_one_robot_is_warned_of(
    others: dict[str, int], twins: int, expected: list[str]
) -> None:
    node, said = _node(others, twins)
    for _ in range(5):
        StageNode.look_for_rivals(node)
    assert said == []  # it may be one that was killed, and has not yet left the graph
    StageNode.look_for_rivals(node)
    assert [topic for topic, _ in said] == expected
    assert all("diagnosed twice" in problem for _, problem in said)


def test_a_rival_that_comes_and_goes_is_none() -> None:
    others = {"residuals": 1}
    node, said = _node(others, 0)
    for number in range(20):
        others["residuals"] = int(number % 5 > 0)
        StageNode.look_for_rivals(node)
    assert said == []
