"""Wheel placement of the plant: angles, rolling directions and their inverse."""

import math

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot

Vector = NDArray[np.float64]


def wheel_angles(robot: Robot) -> Vector:
    """Angles of the wheels anti-clockwise from +x [rad], shape (3,)."""
    return np.asarray(robot.wheel_offset + 2.0 * math.pi / WHEELS * np.arange(WHEELS))


def rolling_rows(robot: Robot) -> Vector:
    """Rim speed of each wheel per unit of body twist (v_x, v_y, omega_z), shape (3, 3).

    A wheel whose axle points outward along theta drives along (sin theta, -cos theta): the
    convention of omni_wheel_drive_controller in ros2_controllers.
    """
    theta = wheel_angles(robot)
    lever = np.full(WHEELS, -robot.robot_radius)
    return np.column_stack([np.sin(theta), -np.cos(theta), lever])
