"""bench/odometry_bound.py: what the bound of the slip odometry is worked out from."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

from odometry_bound import Ride, known_twists
from slippery import slip_error, speed_error, true_twists

from tomr_power_model.robot import GRAVITY, shipped_robot

ROBOT = shipped_robot("reference")
TIMES = 0.02 * np.arange(6)
AHEAD = np.stack([np.linspace(0.0, 0.5, 6), np.zeros(6), np.zeros(6)], axis=1)


def test_wheels_that_grip_hold_the_twist() -> None:
    grips = np.zeros((6, 3), dtype=bool)
    found = known_twists(Ride(TIMES, AHEAD, grips, 0.1), 0.3, {"friction": 0.1}, ROBOT)
    assert found == pytest.approx(AHEAD, abs=1e-9)


def test_wheels_that_slide_pull_with_all_the_traction_there_is() -> None:
    slides = np.ones((6, 3), dtype=bool)
    fast = np.full((6, 3), [0.0, 0.5, 0.0])
    fast[0] = 0.0
    found = known_twists(Ride(TIMES, fast, slides, 0.1), 0.0, {"friction": 0.1}, ROBOT)
    # To the left one wheel pulls wholly and two by half: two thirds of traction times weight.
    assert found[1, 1] == pytest.approx(0.02 * 0.1 * GRAVITY * 2.0 / 3.0, rel=0.02)


def test_a_slope_pulls_a_robot_that_slides() -> None:
    slides = np.ones((6, 3), dtype=bool)
    floor = {"friction": 0.0, "slope": 0.1, "azimuth": math.pi / 2}
    found = known_twists(Ride(TIMES, np.zeros((6, 3)), slides, 0.0), 0.0, floor, ROBOT)
    assert found[-1, 1] == pytest.approx(0.1 * GRAVITY * math.sin(0.1), rel=0.05)
    assert found[-1, 0] == pytest.approx(0.0, abs=1e-6)


def test_a_slope_pulls_one_way_however_the_robot_turns() -> None:
    times, spinning = 0.002 * np.arange(51), np.zeros((51, 3))
    spinning[:, 2] = 10.0
    floor = {"friction": 0.0, "slope": 0.1, "azimuth": 0.0, "roller_drag": 0.0}
    ride = Ride(times, spinning, np.ones((51, 3), dtype=bool), 0.0)
    vx, vy, _ = known_twists(ride, 0.0, floor, ROBOT)[-1]
    # After 0.1 s and a radian: downhill is to the right of the nose.
    assert math.atan2(vy, vx) == pytest.approx(-1.0, abs=0.05)
    assert math.hypot(vx, vy) == pytest.approx(0.1 * GRAVITY * math.sin(0.1), rel=0.05)


def test_true_twists_are_those_of_the_body() -> None:
    times = 0.01 * np.arange(50)
    # Along a circle of 2 m to the left, with the nose ahead: 1 m/s and 0.5 rad/s.
    angle = 0.5 * times + 0.7
    poses = np.stack([2.0 * np.sin(angle), -2.0 * np.cos(angle), angle], axis=1)
    found = true_twists(poses, times)
    assert found[5:-5] == pytest.approx(np.tile([1.0, 0.0, 0.5], (40, 1)), abs=1e-4)


def test_speeds_count_while_wheels_slide_and_ratios_within_a_tenth_of_a_second() -> None:
    off = np.array([[0.3, 0.4, 9.0], [5.0, 5.0, 5.0]])
    assert speed_error(off, np.array([True, False])) == pytest.approx(0.5)
    assert math.isnan(speed_error(off, np.array([False, False])))
    rims, sliding = np.full((60, 3), 0.5), np.zeros((60, 3))
    sliding[30:] = 0.25
    late = np.zeros((60, 3))
    for by, error in ((5, 0.0), (7, 0.5 * math.sqrt(2 / 50))):
        late[30 + by :], late[: 30 + by] = 0.5, 0.0
        assert slip_error(late, sliding, rims) == pytest.approx(error, abs=1e-9)
