"""Traction that creep goes by: what its moment is off by is friction, half of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tomr_odometry.used import UsedTraction
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of, rolling_forces

BODY, RADIUS = body_of(shipped_robot("reference"))
RESTING = np.zeros((2, 3))
LONG = 1e3  # s: nothing of before is left


def used(force: list[float], motion: NDArray[np.float64] | None = RESTING) -> NDArray[np.float64]:
    """Traction of forces [N] that have acted for long, as forces [N]."""
    core = UsedTraction(BODY, RADIUS)
    core.take(np.array(force), motion, LONG)
    return core.value * BODY.load


def test_half_of_what_turns_no_body_is_friction() -> None:
    assert used([4.0, 2.0, 0.0]) == pytest.approx([3.0, 1.0, -1.0])
    assert used([2.0, -1.0, -1.0]) == pytest.approx([2.0, -1.0, -1.0])


def test_forces_that_turn_the_body_are_left_as_they_are() -> None:
    twist, change = np.array([0.2, -0.1, 0.5]), np.array([0.3, 0.1, 4.0])
    force = rolling_forces(BODY, 0.0, twist, change)
    assert abs(force.sum()) > 1.0
    motion = np.stack([BODY.rows @ twist, BODY.rows @ change]) / RADIUS
    assert used(force.tolist(), motion) == pytest.approx(force)
    # A robot that is held against the same forces does not turn: half of them are friction.
    assert used(force.tolist()).sum() == pytest.approx(0.5 * force.sum())


def test_forces_are_averaged_over_0_3_s() -> None:
    core = UsedTraction(BODY, RADIUS)
    core.take(np.array([2.0, -1.0, -1.0]), RESTING, 0.3)
    assert core.value * BODY.load == pytest.approx((1.0 - np.exp(-1.0)) * np.array([2.0, -1, -1]))


def test_where_a_force_or_the_motion_is_not_known_nothing_is_taken_off() -> None:
    assert used([4.0, np.nan, 0.0]) == pytest.approx([4.0, 0.0, 0.0])
    assert used([4.0, 2.0, 0.0], None) == pytest.approx([4.0, 2.0, 0.0])


def test_friction_stays_until_a_force_is_new_or_one_is_lost() -> None:
    core = UsedTraction(BODY, RADIUS)
    for motion in (RESTING, None):
        core.take(np.array([4.0, 2.0, 0.0]), motion, LONG)
        assert core.value * BODY.load == pytest.approx([3.0, 1.0, -1.0])
    core.take(np.array([4.0, 2.0, np.nan]), None, LONG)
    assert core.value * BODY.load == pytest.approx([4.0, 2.0, 0.0])
    core.take(np.array([4.0, 2.0, 0.0]), None, LONG)
    assert core.value * BODY.load == pytest.approx([4.0, 2.0, 0.0])


@given(st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3))
def test_a_robot_turned_by_120_degrees_uses_the_same_traction(force: list[float]) -> None:
    turned = used([force[2], force[0], force[1]])
    assert turned == pytest.approx(np.roll(used(force), 1), abs=1e-9)
