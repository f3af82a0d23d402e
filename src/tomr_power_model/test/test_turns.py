"""Wheel angles that begin anew each turn go on as they turned."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.messages.turns import Turns

TURN = 2.0 * math.pi
NAN = math.nan


def followed(angles: list[float], speeds: list[float] | None = None) -> list[float]:
    """Of one wheel."""
    turns = Turns(1)
    return [
        turns.go_on([angle], [speed])[0]
        for angle, speed in zip(angles, speeds or [NAN] * len(angles), strict=True)
    ]


@given(
    st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=200),
    st.floats(-10.0, 10.0),
    st.sampled_from([-math.pi, 0.0]),
    st.booleans(),
)
def test_any_motion_comes_out_but_for_whole_turns(
    steps: list[float], start: float, lowest: float, has_speed: bool
) -> None:
    """Of drivers that begin at -pi, or at 0."""
    true = start + np.cumsum(steps)
    given_angles = ((true - lowest) % TURN + lowest).tolist()
    speeds = [step / 0.01 for step in steps] if has_speed else None
    found = np.array(followed(given_angles, speeds))
    assert np.allclose(found - found[0], true - true[0], atol=1e-6)


@given(st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=200), st.floats(-1e4, 1e4))
def test_angles_that_go_on_stay_as_they_are(steps: list[float], start: float) -> None:
    angles = (start + np.cumsum(steps)).tolist()
    assert followed(angles) == angles


def test_single_precision_begins_anew_as_well() -> None:
    true = np.arange(0.0, 20.0, 0.3)
    given_angles = ((true + math.pi) % TURN - math.pi).astype(np.float32).astype(float)
    assert np.allclose(followed(given_angles.tolist()), true, atol=1e-5)


def test_angles_that_were_missed_are_no_new_turn() -> None:
    """They go the way of the wheel."""
    assert followed([0.0, 5.5], [10.0, 10.0]) == [0.0, 5.5]
    assert followed([5.5, 0.0], [-10.0, -10.0]) == [5.5, 0.0]
    assert followed([5.5, 0.0], [10.0, 10.0]) == [5.5, pytest.approx(TURN)]


def test_a_counter_that_is_set_to_zero_is_no_new_turn() -> None:
    assert followed([4.0, 0.0, 0.1]) == [4.0, 0.0, 0.1]


def test_what_has_been_outside_of_one_turn_does_not_begin_anew() -> None:
    assert followed([-1.0, 2.0, 5.4, 0.2]) == [-1.0, 2.0, 5.4, 0.2]


def test_a_wheel_that_is_missing_goes_on_where_it_is() -> None:
    found = followed([3.0, NAN, -3.0])
    assert math.isnan(found[1])
    assert found[2] == pytest.approx(TURN - 3.0)


def test_each_wheel_turns_for_itself() -> None:
    turns = Turns(3)
    turns.go_on([3.0, 0.0, -3.0], [NAN] * 3)
    assert turns.go_on([-3.0, 0.1, 3.0], [NAN] * 3) == pytest.approx([TURN - 3.0, 0.1, 3.0 - TURN])
