"""Radii and places of wheels as described against those that the drivers go by.

Drivers with an integral reach the wheel speeds that they are asked for whatever the motors are
like. So where the wheels turn otherwise than a simulation of the description has them, in the same
ratio throughout, the description has another radius than what turns commands into wheel speeds:

    omega = (v + R omega_z) / r

Straight drives show r, turning on the spot R / r, and the direction where wheels stand around it.
"""

import numpy as np
from attrs import frozen
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

SPAN = 0.3  # s, of a fit to the encoders
_AROUND = 0.3  # s before and after, in which a motion is steady
_STEADY = 0.5  # m/s^2, rad/s^2
_DRIVES, _TURNS = 0.1, 0.2  # m/s, rad/s
_LEAST = 3.0  # s of steady motion
_OFF = 0.004  # of 1, and rad, by which these may differ: healthy robots' samples do by 0.0008
_ALIKE = 0.25  # of what one differs by, within which most of the motion has the same
_NOISE = 0.01  # the same, of encoders
_MOST = 0.8
_GROSS = 1.6  # and its logarithm in rad


@frozen
class Answer:
    """Twist that the wheels turn with, against that which a simulation has; None where too little
    shows it, NaN where it is not alike throughout, as with a fault."""

    linear: float | None  # ratio
    yaw: float | None  # ratio
    turned: float | None  # direction of the linear part, anti-clockwise [rad]


def answer(time: Array, measured: Array, expected: Array, robot: Robot) -> Answer:
    """How the steady motion of a drive answers to its commands.

    Args:
        time: evenly spaced [s], (n,).
        measured: wheel speeds then [rad/s], (n, 3), NaN where unknown.
        expected: those of the description's simulation [rad/s], (n, 3), NaN where unknown.
        robot: the description.
    """
    period = median_period(time)
    to_twist = np.linalg.inv(twist_to_wheels(robot, nominal=True)).T
    seen, asked = measured @ to_twist, expected @ to_twist
    known = np.isfinite(seen).all(axis=1) & np.isfinite(asked).all(axis=1)
    change = np.abs(np.diff(np.nan_to_num(asked), axis=0, append=0.0)).max(axis=1) / period
    known &= _greatest(change, max(1, round(_AROUND / period))) < _STEADY
    seen, asked, least = seen[known], asked[known], _LEAST / period
    fast = np.linalg.norm(asked[:, :2], axis=1) > _DRIVES
    (sx, sy), (ax, ay) = seen[fast, :2].T, asked[fast, :2].T
    turns = np.abs(asked[:, 2]) > _TURNS
    return Answer(
        _usual(np.hypot(sx, sy) / np.hypot(ax, ay), 1.0, least),
        _usual(seen[turns, 2] / asked[turns, 2], 1.0, least),
        _usual(np.arctan2(sy * ax - sx * ay, sx * ax + sy * ay), 0.0, least),
    )


def _greatest(values: Array, around: int) -> Array:
    """Of so many values before and after each, (n,)."""
    padded = np.pad(values, around, mode="edge")
    return np.asarray(sliding_window_view(padded, 2 * around + 1).max(axis=1))


def _usual(found: Array, neutral: float, least: float) -> float | None:
    """What most values are about; NaN where they differ, None of fewer than `least`."""
    if len(found) < least:
        return None
    middle = float(np.median(found))
    alike = np.abs(found - middle) < max(_ALIKE * abs(middle - neutral), _NOISE)
    return middle if np.mean(alike) > _MOST else np.nan


def misdescribed(found: Answer, robot: Robot) -> tuple[str, str]:
    """What is seen where the description is another than the drivers have, and what to write;
    empty where it is not. Of drivers without an integral friction decides how fast they turn."""
    if robot.controller.integral <= 0.0 or found.linear is None or found.turned is None:
        return "", ""
    linear = found.linear
    turn = 1.0 if found.yaw is None else found.yaw / linear
    # Gross mistakes are others': an order of wheels, a sign. False where one is not a number.
    is_near = all(_GROSS > ratio > 1.0 / _GROSS for ratio in (linear, turn))
    if not (is_near and abs(found.turned) < np.log(_GROSS)):
        return "", ""
    seen, keys = [], []
    if abs(linear - 1.0) > _OFF:
        seen.append(f"they turn {linear:.3f} times as fast as described")
        keys.append(f"robot.wheel_radius: {robot.wheel_radius / linear:.4g}")
    if abs(turn - 1.0) > _OFF:
        seen.append(f"where the robot turns, {turn:.3f} times as fast")
        keys.append(f"robot.robot_radius: {robot.robot_radius * turn:.4g}")
    if abs(found.turned) > _OFF:
        seen.append(f"they drive {np.degrees(found.turned):+.1f} degrees beside the command")
        keys.append(f"robot.wheel_offset: {robot.wheel_offset - found.turned:.6g}")
    if not keys:
        return "", ""
    return (
        ", ".join(seen),
        f"write {', '.join(keys)}, as the drivers have it, or see what changes the commands on "
        "their way",
    )
