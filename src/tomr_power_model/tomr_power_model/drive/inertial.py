"""An IMU in a recording: left out where it is not as described, with a note."""

from bisect import bisect_right

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.motion import wheel_motion
from tomr_power_model.drive.mounting import SLOT, MountingWatch
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import Robot


def without_mistaken_imu(drive: Drive, robot: Robot) -> tuple[Drive, list[str]]:
    """A recording without an IMU that is mounted, signed or scaled otherwise, and what to say."""
    mistake = imu_mistake_in(drive, robot) if len(drive.imu_time) > 1 else ""
    if not mistake:
        return drive, []
    left = evolve(drive, imu_time=np.empty(0), inertial=np.empty((0, 6)))
    return left, [f"{drive.name}: {mistake}; imu/data is left out"]


def imu_mistake_in(drive: Drive, robot: Robot) -> str:
    """What is wrong with an IMU, as nodes say it at the end of the drive; empty where nothing."""
    watch, slot = MountingWatch(robot), SLOT / NANOSECONDS
    times = np.arange(0.0, drive.duration, slot)
    motion = wheel_motion(drive.encoder_time, drive.position, drive.velocity, times, slot)
    twists = motion.speed @ wheels_to_twist(robot).T
    stamps, samples = _stamps(drive.imu_time), drive.inertial.tolist()
    first = 0
    for stamp, twist in zip(_stamps(times), twists, strict=True):
        last = bisect_right(stamps, stamp)
        for row in range(first, last):
            watch.add(stamps[row], samples[row])
        watch.look(stamp, twist)
        first = last
    return watch.mistake


def _stamps(times: NDArray[np.float64]) -> list[int]:
    return [round(time * NANOSECONDS) for time in times.tolist()]
