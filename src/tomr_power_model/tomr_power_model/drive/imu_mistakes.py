"""Whether an IMU is mounted, signed or scaled otherwise than described: which, and what to mend.

The wheels show how fast the robot turns, and how it speeds up; a robot at rest, and on average any,
feels gravity upwards. So whichever way the IMU's axes point, what they measure says how. Wheels
that slide show no other IMU: what is measured then belongs to no mounting.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import permutations, product

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.messages.inertial import rotation, rpy_of
from tomr_power_model.robot import GRAVITY

Array = NDArray[np.float64]

_TURNS, _ACCELERATES = 0.2, 0.3  # rad/s and m/s^2, from which on a row says something
_LEAST = 6  # rows that do
_STRAYS = 0.15  # share of the rates that are none of the wheels' turning
_UNSURE = 0.15  # standard error of a direction of acceleration, relative
_ONE_WAY = 5.0  # how much more of one direction there may be than of the other
_SIGMAS = 3.0  # of that, by which a direction has to be off
_FITS = math.cos(math.radians(20.0))
_ALIKE = math.radians(8.0)
_RIGHT = math.cos(_ALIKE)  # nearer to right angles than that it is mounted by them
_DEGREES = 180.0 / math.pi
_WHOLE = 0.25  # relative
_STEP = 0.05  # rad, in which a mounting is said
_ABOUT = 0.15  # relative, of units
_STEEP = math.cos(math.radians(35.0))  # no robot drives on what is steeper
_WEIGHS = 6.0  # m/s^2, that show which way is up
_SIGNS = (
    (1.0, -1.0, "the gyro of imu/data turns the other way", "change its sign in the driver"),
    (
        -1.0,
        1.0,
        "imu/data feels forces the other way",
        "change their signs in the driver: a robot at rest feels 9.81 m/s^2 upwards (REP 145)",
    ),
)
_OTHERWISE = "imu/data is mounted otherwise than described: write robot.imu_rpy"


@frozen
class Felt:
    """What an IMU measures beside what the wheels show in the same moments; NaN where unknown."""

    yaw_rate: Array  # by the wheels [rad/s], (n,)
    acceleration: Array  # by the wheels, along x and y [m/s^2], (n, 2)
    rate: Array  # measured [rad/s], (n, 3)
    force: Array  # measured [m/s^2], (n, 3)


@frozen
class _Shown:
    """A direction in the IMU's axes and what it is in base_link, (3,) each."""

    measured: Array  # its length: of what is measured by what there is
    true: Array
    is_turning: bool = False
    error: float = 0.0  # standard, of its direction [rad]

    def along(self, turned: Array, sign: float) -> float:
        """Cosine between what a rotation (3, 3) and a sign make of it and what it is."""
        seen = sign * turned @ self.measured
        cosine = float(seen @ self.true / np.linalg.norm(seen))
        return min(max(cosine, -1.0), 1.0)


def imu_mistake(felt: Felt, rpy: Sequence[float]) -> str | None:
    """What is wrong with an IMU and what to mend, "" where it is as described, None where that
    does not show; `rpy`: how it is described to be mounted, with which `felt` is in base_link."""
    up, turning, along = _up(felt), _turning(felt), _along(felt)
    is_upright = up is None or up.along(np.eye(3), 1.0) > _STEEP
    if turning is None and not along:
        return None if is_upright else _OTHERWISE
    shown = [item for item in (up, turning, *along) if item is not None]
    # What is a little off from upright may be a slope.
    sure = [item for item in shown if item is not up or not is_upright]
    units = list(_units(up, turning, along))
    off = math.acos(min(item.along(np.eye(3), 1.0) for item in sure))
    if off < _ALIKE:
        is_all = turning is not None or not np.isfinite(felt.rate).any()
        is_all &= bool(along) or not np.isfinite(felt.force).any()
        return "; ".join(units) if units or is_all else None
    is_clear = off > _SIGMAS * max(item.error for item in shown)
    mounting = _mounting(shown, shown if turning is None else sure, rpy) if is_clear else ""
    if not mounting and is_upright:
        return None
    return "; ".join([mounting or _OTHERWISE, *units])


def _up(felt: Felt) -> _Shown | None:
    """Gravity as it is felt on average; None where it is taken off, or forces are not measured."""
    known = np.isfinite(felt.force).all(axis=1)
    if not known.any():
        return None
    mean = felt.force[known].mean(axis=0) / GRAVITY
    size = float(np.linalg.norm(mean))
    is_weight = size * GRAVITY > _WEIGHS or abs(size * GRAVITY - 1.0) < _ABOUT
    return _Shown(mean, np.array([0.0, 0.0, 1.0])) if is_weight else None


def _turning(felt: Felt) -> _Shown | None:
    """The axis that turns as the wheels do."""
    rate = np.where(np.isfinite(felt.rate).any(axis=0), felt.rate, 0.0)  # axes it may not have
    known = np.isfinite(felt.yaw_rate) & np.isfinite(rate).all(axis=1)
    yaw, rate = felt.yaw_rate[known], rate[known]
    if np.count_nonzero(np.abs(yaw) > _TURNS) < _LEAST or not rate.any():
        return None
    axis = rate.T @ yaw / (yaw @ yaw)
    if np.sum((rate - np.outer(yaw, axis)) ** 2) > _STRAYS * np.sum(rate**2):
        return None
    return _Shown(axis, np.array([0.0, 0.0, 1.0]), is_turning=True)


def _along(felt: Felt) -> list[_Shown]:
    """What is felt of the accelerations in the directions that there are enough of."""
    known = np.isfinite(felt.acceleration).all(axis=1) & np.isfinite(felt.force).all(axis=1)
    pull, force = felt.acceleration[known], felt.force[known]
    if np.count_nonzero(np.linalg.norm(pull, axis=1) > _ACCELERATES) < _LEAST:
        return []
    pull, force = pull - pull.mean(axis=0), force - force.mean(axis=0)
    _, sizes, directions = np.linalg.svd(pull, full_matrices=False)
    found = []
    for size, direction in zip(sizes, directions, strict=True):
        if size <= sizes[0] / _ONE_WAY:
            continue
        strength = pull @ direction
        axis = force.T @ strength / size**2
        left = force - np.outer(strength, axis)
        error = math.sqrt(float(np.sum(left**2)) / len(pull)) / size
        error /= float(np.linalg.norm(axis)) or math.nan
        if error < _UNSURE:  # false where nothing is felt
            found.append(_Shown(axis, np.array([*direction, 0.0]), error=error))
    return found


def _units(up: _Shown | None, turning: _Shown | None, along: list[_Shown]) -> Iterator[str]:
    if turning is not None and _is_about(float(np.linalg.norm(turning.measured)), _DEGREES):
        yield "imu/data seems to give degrees per second in place of rad/s: mend its driver"
    sizes = [float(np.linalg.norm(item.measured)) * GRAVITY for item in (up, *along) if item]
    if along and up and all(abs(size - 1.0) < 2.0 * _ABOUT for size in sizes):
        yield "imu/data seems to give g in place of m/s^2: mend its driver"


def _is_about(size: float, much: float) -> bool:
    return abs(size / much - 1.0) < _ABOUT


def _is_whole(shown: Sequence[_Shown]) -> bool:
    """Whether all is measured in the size that it has, in whichever unit: that wheels slide, or
    somebody pushes, is no part of it."""
    forces = [float(np.linalg.norm(item.measured)) for item in shown if not item.is_turning]
    rates = [float(np.linalg.norm(item.measured)) for item in shown if item.is_turning]
    unit = forces[0] if forces and _is_about(forces[0] * GRAVITY, 1.0) else 1.0
    sizes = [size / unit for size in forces]
    sizes += [size / (_DEGREES if _is_about(size, _DEGREES) else 1.0) for size in rates]
    return all(abs(math.log(size)) < _WHOLE for size in sizes)


def _mounting(shown: Sequence[_Shown], sure: Sequence[_Shown], rpy: Sequence[float]) -> str:
    """What explains all that is shown; `sure`: what a rotation is taken from."""
    if not _is_whole(shown):
        return ""
    is_reversed = any(item.along(np.eye(3), 1.0) < 0.0 for item in shown)
    for force, turning, seen, remedy in _SIGNS:
        if is_reversed and all(
            item.along(np.eye(3), turning if item.is_turning else force) > _FITS for item in shown
        ):
            return f"{seen}: {remedy}"
    turned, is_known = _rotation(sure)
    if not is_known or any(item.along(turned, 1.0) < _FITS for item in shown):
        return ""
    roll, pitch, yaw = rpy_of(_squared(turned @ rotation(rpy)))
    return f"{_OTHERWISE}: [{_plain(roll)}, {_plain(pitch)}, {_plain(yaw)}]"


def _rotation(shown: Sequence[_Shown]) -> tuple[Array, bool]:
    """That takes what is measured nearest to what it is, and whether it is the only one (Wahba's
    problem, by Markley 1988)."""
    units = [item.measured / np.linalg.norm(item.measured) for item in shown]
    matrix = sum(np.outer(item.true, unit) for item, unit in zip(shown, units, strict=True))
    left, sizes, right = np.linalg.svd(matrix)
    hand = np.diag([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)])
    return np.asarray(left @ hand @ right), bool(sizes[1] > 0.5)


def _squared(turned: Array) -> Array:
    """The rotation by right angles next to one, where that is near; else the same."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        straight = np.diag(signs)[list(order)]
        angle = (float(np.trace(turned.T @ straight)) - 1.0) / 2.0
        if np.linalg.det(straight) > 0.0 and angle > _RIGHT:
            return straight
    return turned


def _plain(angle: float) -> str:
    """As exactly as it can be said: right angles are, others by steps that stay the same."""
    is_right = abs(math.remainder(angle, math.pi / 2.0)) < 1e-9
    return f"{(round(angle, 4) if is_right else _STEP * round(angle / _STEP)) + 0.0:.5g}"
