"""Poses in the plane, against hand-worked ones."""

import math

import numpy as np
import pytest

from tomr_power_model.geometry.poses import moved, seen_from

QUARTER = 0.5 * math.pi


def test_a_way_is_taken_along_the_mean_heading() -> None:
    ahead = moved(np.array([1.0, 2.0, QUARTER]), np.array([3.0, 1.0, 0.0]))
    assert ahead == pytest.approx([0.0, 5.0, QUARTER])
    # Half of a turn by 90 degrees: 45 degrees to the left.
    turning = moved(np.zeros(3), np.array([math.sqrt(2.0), 0.0, QUARTER]))
    assert turning == pytest.approx([1.0, 1.0, QUARTER])


def test_a_pose_is_seen_from_another() -> None:
    frame = np.array([1.0, 2.0, QUARTER])
    assert seen_from(np.array([1.0, 5.0, math.pi]), frame) == pytest.approx([3.0, 0.0, QUARTER])
    poses = np.array([[0.3, -0.2, 0.4], [2.0, 1.0, -1.0]])
    there = moved(frame, seen_from(poses, frame) * [1.0, 1.0, 0.0])
    assert there[:, :2] == pytest.approx(poses[:, :2])
