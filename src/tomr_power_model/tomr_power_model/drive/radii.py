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
_ALIKE = 0.25  # of what a motion differs by, within which most of it is as expected by these
_NOISE = 0.01  # of a speed: the same, of encoders
_MOST = 0.8
_SHARE = 0.05  # of the motion, which counts as a way of moving
_GROSS = 1.6  # and its logarithm in rad


@frozen
class Answer:
    """Twist that the wheels turn with, against that which a simulation has."""

    linear: float  # ratio
    yaw: float | None  # ratio; None where the robot turned too little
    turned: float  # direction of the linear part, anti-clockwise [rad]
    ways: int  # of moving, 1 to 3: straight drives to and fro are one, and so is a circle


def answer(time: Array, measured: Array, expected: Array, robot: Robot) -> Answer | None:
    """How the steady motion of a drive answers to its commands; None where too little shows it, or
    where it is not alike throughout, as with a fault.

    Args:
        time: evenly spaced [s], (n,).
        measured: wheel speeds then [rad/s], (n, 3), NaN where unknown.
        expected: those of the description's simulation [rad/s], (n, 3), NaN where unknown.
        robot: the description.
    """
    period = median_period(time)
    to_twist = np.linalg.inv(twist_to_wheels(robot, nominal=True)).T
    # In m/s all three, turning at the wheels.
    scale = np.array([1.0, 1.0, robot.robot_radius])
    seen, asked = measured @ to_twist * scale, expected @ to_twist * scale
    known = np.isfinite(seen).all(axis=1) & np.isfinite(asked).all(axis=1)
    change = np.abs(np.diff(np.nan_to_num(asked / scale), axis=0, append=0.0)).max(axis=1) / period
    known &= _greatest(change, max(1, round(_AROUND / period))) < _STEADY
    fast = known & (np.linalg.norm(asked[:, :2], axis=1) > _DRIVES)
    turns = known & (np.abs(asked[:, 2]) > _TURNS * robot.robot_radius)
    if fast.sum() < _LEAST / period:
        return None
    # As complex numbers: the ratio of two has their directions' difference.
    ways = seen[fast, :2] @ (1.0, 1.0j), asked[fast, :2] @ (1.0, 1.0j)
    linear = float(np.median(np.abs(ways[0] / ways[1])))
    turned = float(np.median(np.angle(ways[0] / ways[1])))
    is_shown = turns.sum() >= _LEAST / period
    yaw = float(np.median(seen[turns, 2] / asked[turns, 2])) if is_shown else None
    seen, asked = seen[fast | turns], asked[fast | turns]
    found = Answer(linear, yaw, turned, _ways(asked))
    return found if _is_alike(seen, asked, found) else None


def _greatest(values: Array, around: int) -> Array:
    """Of so many values before and after each, (n,)."""
    padded = np.pad(values, around, mode="edge")
    return np.asarray(sliding_window_view(padded, 2 * around + 1).max(axis=1))


def _ways(asked: Array) -> int:
    """In how many ways that differ twists (n, 3) move the robot."""
    unit = asked / np.linalg.norm(asked, axis=1, keepdims=True)
    return int((np.linalg.eigvalsh(unit.T @ unit / len(unit)) > _SHARE).sum())


def _is_alike(seen: Array, asked: Array, found: Answer) -> bool:
    """Whether most twists (n, 3) are as an answer has them."""
    cos, sin = found.linear * np.cos(found.turned), found.linear * np.sin(found.turned)
    yaw = found.linear if found.yaw is None else found.yaw
    expected = asked @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, yaw]])
    off, change, size = (
        np.linalg.norm(twists, axis=1) for twists in (seen - expected, expected - asked, asked)
    )
    return bool(np.mean(off < np.maximum(_ALIKE * change, _NOISE * size)) > _MOST)


def misdescribed(found: Answer | None, robot: Robot) -> tuple[str, str]:
    """What is seen where the description is another than the drivers have, and what to write;
    empty where it is not. Of drivers without an integral friction decides how fast they turn."""
    if found is None or robot.controller.integral <= 0.0:
        return "", ""
    linear, turned = found.linear, found.turned
    # Gross mistakes are others': an order of wheels, a sign; and so are wheels that stand.
    if not 1.0 / _GROSS < linear < _GROSS or abs(turned) > np.log(_GROSS):
        return "", ""
    turn = 1.0 if found.yaw is None else found.yaw / linear
    if not 1.0 / _GROSS < turn < _GROSS:
        return "", ""
    seen, keys = [], []
    if abs(linear - 1.0) > _OFF:
        seen.append(f"they turn {linear:.3f} times as fast as described")
        keys.append(f"robot.wheel_radius: {robot.wheel_radius / linear:.4g}")
    if abs(turn - 1.0) > _OFF:
        seen.append(f"where the robot turns, {turn:.3f} times as fast")
        keys.append(f"robot.robot_radius: {robot.robot_radius * turn:.4g}")
    if abs(turned) > _OFF:
        seen.append(f"they drive {np.degrees(turned):+.1f} degrees beside the command")
        keys.append(f"robot.wheel_offset: {robot.wheel_offset - turned:.6g}")
    # A motion of one kind has any three wheel speeds by three such values: as with a dead wheel.
    if not keys or len(keys) > found.ways:
        return "", ""
    return (
        ", ".join(seen),
        f"write {', '.join(keys)}, as the drivers have it, or see what changes the commands on "
        "their way",
    )
