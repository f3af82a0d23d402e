"""Poses in the plane: x, y [m] and yaw [rad], arrays of shape (..., 3)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def moved(pose: Array, way: Array) -> Array:
    """Poses after ways [m, m, rad] in their own frames, straight along the mean heading."""
    yaw = pose[..., 2] + 0.5 * way[..., 2]
    return pose + turned(way, yaw)


def seen_from(pose: Array, frame: Array) -> Array:
    """Poses in the frame that another pose is."""
    return turned(pose - frame, -frame[..., 2])


def turned(way: Array, yaw: Array) -> Array:
    """Ways, or twists, turned by so much [rad]; what they turn themselves stays."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = way[..., 0], way[..., 1]
    return np.stack([c * x - s * y, s * x + c * y, way[..., 2]], axis=-1)
