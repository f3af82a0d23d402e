"""Paths, against hand-worked ones."""

import math

import numpy as np
import pytest

from tomr_odometry.reference import Path2D


def test_a_path_is_laid_on_a_pose_as_a_whole() -> None:
    """From (1, 1) along x it goes 2 m ahead; laid to begin at 0, along y."""
    path = Path2D(np.array([0, 1], dtype=np.int64), np.array([[1.0, 1.0, 0.0], [3.0, 1.0, 0.5]]))
    laid = path.laid_on(np.array([0.0, 0.0, 0.5 * math.pi]), path.pose[0])
    expected = np.array([[0.0, 0.0, 0.5 * math.pi], [0.0, 2.0, 0.5 + 0.5 * math.pi]])
    assert laid.pose == pytest.approx(expected)
    assert laid.stamps.tolist() == [0, 1]
