"""Laws that residuals may follow, by hand."""

import math

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.laws import Window

# Ahead and to the left at 1 m/s, and three motors that show what they must: one band per N m, then
# two, of a robot whose motors feel one axis each.
WINDOW = Window(
    # 3 N/kg at a hitch at (0, 1): its moment ahead is -3 N m/kg.
    shown=np.array([[3.0, 0.0, -3.0], [0.0, 6.0, 0.0]]),
    seen=np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]),
    powers=np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]]),
    twist=np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    yaw=np.zeros(2),
    torques=np.eye(3),
)


def shows(*rows: tuple[float, float, float]) -> Window:
    return evolve(WINDOW, shown=np.array(rows))


def test_a_drag() -> None:
    assert WINDOW.sum_of_squares == pytest.approx(54.0)
    left, drag = WINDOW.left_by_drag(np.array([[0.0, 0.0], [0.0, 1.0]]))
    assert (left, drag) == (pytest.approx(0.0, abs=0.01), pytest.approx(3.0, abs=0.01))
    left, _ = WINDOW.left_by_drag(np.zeros((1, 2)))
    assert left == pytest.approx(9.0, abs=0.01)  # the moment


def test_nothing_drags_a_robot_on() -> None:
    left, drag = evolve(WINDOW, shown=-WINDOW.shown).left_by_drag(np.array([[0.0, 1.0]]))
    assert (left, drag) == (pytest.approx(54.0), 0.0)


def test_a_force_of_one_direction() -> None:
    # That which grows from nothing explains the second tick, and none of the first.
    assert WINDOW.left_by_push() == (pytest.approx(18.0), 0.0)
    steady = shows((3.0, 0.0, 0.0), (6.0, 0.0, 0.0))
    assert steady.left_by_push() == (pytest.approx(0.0, abs=0.01), pytest.approx(3.0, abs=0.01))


def test_a_slope_turns_nothing() -> None:
    turning = shows((0.0, 3.0, 3.0), (0.0, 6.0, 6.0))
    assert turning.left_by_push()[0] == pytest.approx(0.0, abs=0.01)
    left, pull = turning.left_by_push(turns=False)
    assert (left, pull) == (pytest.approx(45.0, abs=0.01), pytest.approx(3.0, abs=0.01))


def test_a_direction_of_the_world() -> None:
    """The robot turns by a quarter, and what came from ahead comes from the right."""
    turned = evolve(shows((3.0, 0.0, 0.0), (0.0, -6.0, 0.0)), yaw=np.array([0.0, math.pi / 2.0]))
    assert turned.left_by_push() == (pytest.approx(0.0, abs=0.01), pytest.approx(3.0, abs=0.01))


def test_torques_that_are_constant() -> None:
    # 3 / 5 N m of motors 1 and 3, which leaves 9 - 9 / 5; 12 / 5 of 2, which leaves 36 - 144 / 5.
    assert WINDOW.left_by_torques() == pytest.approx(7.2 + 7.2 + 7.2, abs=0.01)
    assert shows((3.0, 0.0, -1.0), (6.0, 0.0, -2.0)).left_by_torques() == pytest.approx(0, abs=0.01)


def test_a_power_that_is_constant() -> None:
    # (3 - 3 - 6) / 6 W, which leaves 54 - 6.
    assert WINDOW.left_by_power() == pytest.approx(48.0, abs=0.01)
    braking = shows((2.0, 2.0, 2.0), (2.0, -2.0, 2.0))
    assert braking.left_by_power() == pytest.approx(0.0, abs=0.01)


def test_a_wheel_that_bears_all_alone() -> None:
    to_twist = np.diag([1.0, 1.0, 0.0]) + np.diag([0.0, 0.0, 1.0])
    alone = shows((0.0, 5.0, 0.0), (0.0, -4.0, 0.0))
    assert alone.left_by_encoder(to_twist) == pytest.approx(0.0)
    assert WINDOW.left_by_encoder(to_twist) == pytest.approx(18.0)


def test_what_the_others_feel_of_an_encoder_that_shows_too_little() -> None:
    """Wheel 3 turns the body at 1 rad/s where it shows 0.5: twice as much force to the left."""
    to_twist: NDArray[np.float64] = np.eye(3)
    twist = np.array([[2.0, 0.0, 0.5], [2.0, 0.0, 0.5]])
    window = evolve(WINDOW, twist=twist, shown=np.array([[0.0, 1.0, 9.0], [0.0, 2.0, 7.0]]))
    assert window.left_by_encoder(to_twist) == pytest.approx(0.0)  # 0.5 rad/s more, at 2 m/s


def test_wheels_that_turn() -> None:
    assert WINDOW.moving == 1.0
    assert evolve(WINDOW, seen=np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 1.0]])).moving == 0.5
