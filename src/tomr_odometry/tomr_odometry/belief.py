"""Whether the IMU is believed: not where it repeats itself, nor where it is not as described."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.stuck import StuckImu
from tomr_power_model.drive.mounting import MountingWatch
from tomr_power_model.geometry.poses import moved
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


class Belief:
    """Holds the IMU against the wheels, and knows where these alone have the robot."""

    def __init__(self, robot: Robot, to_twist: Array) -> None:
        """`to_twist`: (3, n), from the rims' speeds to the body's twist."""
        self._to_twist = to_twist
        self._mounting = MountingWatch(robot)
        self.clear(np.zeros(3))

    def clear(self, pose: Array) -> None:
        """Forget all samples; the robot is at a pose, and its IMU is the same."""
        self._stuck = StuckImu(self._to_twist)
        self._mounting.clear()
        self._ways = np.zeros(self._to_twist.shape[1])
        self.pose = pose.copy()  # by the wheels alone

    @property
    def mistake(self) -> str:
        """In which way it is not as described, in words; empty if it is."""
        return self._mounting.mistake

    def take(self, stamp_ns: int, values: Sequence[float]) -> bool:
        """Take angular rates [rad/s] and specific forces [m/s^2], NaN for what is not measured;
        returns whether they are believed."""
        self._mounting.add(stamp_ns, values)
        return not self._stuck.take(stamp_ns, values) and not self.mistake

    def look(self, stamp_ns: int, rims: Array, ways: Array) -> tuple[bool, bool]:
        """Hold it against the rims' speeds [m/s] and ways since the start [m], (n,) each, at a
        time; returns whether it is found now to repeat itself, and to be not as described."""
        self.pose = moved(self.pose, self._to_twist @ (ways - self._ways))
        self._ways = ways.copy()
        is_stuck = self._stuck.look(stamp_ns, rims)
        return is_stuck, self._mounting.look(stamp_ns, self._to_twist @ rims)
