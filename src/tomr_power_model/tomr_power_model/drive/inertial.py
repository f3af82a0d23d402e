"""An IMU in a recording: left out where it is not as described, with a note."""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.imu_mistakes import Felt, imu_mistake
from tomr_power_model.drive.motion import wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_SLOT = 0.1  # s, over which an IMU is averaged
_MOVES = 0.02  # m/s, rad/s


def without_mistaken_imu(drive: Drive, robot: Robot) -> tuple[Drive, list[str]]:
    """A recording without an IMU that is mounted, signed or scaled otherwise, and what to say."""
    mistake = imu_mistake(felt_in(drive, robot), robot.imu_rpy) if len(drive.imu_time) > 1 else ""
    if not mistake:
        return drive, []
    left = evolve(drive, imu_time=np.empty(0), inertial=np.empty((0, 6)))
    return left, [f"{drive.name}: {mistake}; imu/data is left out"]


def felt_in(drive: Drive, robot: Robot) -> Felt:
    """What an IMU measured while the wheels turned, and what these show."""
    edges = np.arange(0.0, drive.duration, _SLOT)
    middle = edges[:-1] + 0.5 * _SLOT
    motion = wheel_motion(drive.encoder_time, drive.position, drive.velocity, middle, _SLOT)
    to_twist = wheels_to_twist(robot)
    twist, rate = motion.speed @ to_twist.T, motion.acceleration @ to_twist.T
    turning = twist[:, 2]
    acceleration = rate[:, :2] + turning[:, None] * np.stack([-twist[:, 1], twist[:, 0]], axis=1)
    measured = _averaged(drive, edges)
    moves = np.abs(twist).max(axis=1) > _MOVES  # false where NaN
    return Felt(turning[moves], acceleration[moves], measured[moves, :3], measured[moves, 3:])


def _averaged(drive: Drive, edges: Array) -> Array:
    """Means of what the IMU measured between edges [s], (n, 6), NaN without a sample."""
    slot = np.searchsorted(edges, drive.imu_time, side="right") - 1
    inside = (slot >= 0) & (slot < len(edges) - 1)
    count = np.bincount(slot[inside], minlength=len(edges) - 1)[: len(edges) - 1]
    sums = np.stack(
        [
            np.bincount(slot[inside], weights=column[inside], minlength=len(edges) - 1)
            for column in drive.inertial.T
        ],
        axis=1,
    )
    return np.asarray(sums / np.where(count, count, np.nan)[:, None])
