"""bench/odometry_bound.py: what the bound of the slip odometry is worked out from."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

from odometry_bound import Ride, known_twists

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
