"""Kinematics of three omni wheels, in the convention of ros2_controllers' omni controller.

Wheel i = 0..2 sits at theta_i = wheel_offset + 2 pi i / 3, anti-clockwise from +x:

    r_i omega_i = sin(theta_i) v_x - cos(theta_i) v_y - R omega_z
"""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]


def wheel_angles(robot: Robot) -> Array:
    """Angle of each wheel around the robot [rad], shape (3,)."""
    return robot.wheel_offset + 2.0 * np.pi * np.arange(WHEELS) / WHEELS


def wheel_radii(robot: Robot) -> Array:
    """Effective radius of each wheel [m], shape (3,)."""
    return robot.wheel_radius * np.array(robot.everywhere("kinematic.wheel_radius", "scale", 1.0))


def twist_to_wheels(robot: Robot, nominal: bool = False) -> Array:
    """Matrix K of omega = K (v_x, v_y, omega_z) [1/m, 1/m, -], shape (3, 3).

    `nominal` leaves out that wheels may differ in radius: what a driver believes.
    """
    theta = wheel_angles(robot)
    radii = np.full(WHEELS, robot.wheel_radius) if nominal else wheel_radii(robot)
    arm = np.full(WHEELS, -robot.robot_radius)
    rows = np.stack([np.sin(theta), -np.cos(theta), arm], axis=1)
    return np.asarray(rows / radii[:, None])


def wheels_to_twist(robot: Robot) -> Array:
    """Inverse of `twist_to_wheels`: (v_x, v_y, omega_z) = K^-1 omega, shape (3, 3)."""
    return np.asarray(np.linalg.inv(twist_to_wheels(robot)), dtype=np.float64)
