"""What an IMU's messages say in base_link, however it is mounted.

Nodes run without scipy, which has rotations as well: two functions of it are here.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.messages.intake import LARGEST, Triple, Unusable

Array = NDArray[np.float64]

_UNKNOWN = (math.nan, math.nan, math.nan)
_NONE = 1e-4  # of an axis: 1.5708 is a right angle


class Imu:
    """Reads an IMU that is turned by `robot.imu_rpy` against base_link."""

    def __init__(self, rpy: Triple) -> None:
        """`rpy`: roll, pitch and yaw of its axes in base_link [rad], as a URDF's."""
        rows = rotation(rpy) if any(rpy) else np.eye(3)
        # An axis that is not measured spoils only those that it has a part in.
        self._parts = [
            [(place, part) for place, part in enumerate(row) if abs(part) > _NONE]
            for row in rows.tolist()
        ]
        self._is_turned = any(rpy)

    def read(self, message: Any) -> tuple[Triple, Triple]:
        """Angular rate [rad/s] and specific force [m/s^2] along base_link's x, y and z, NaN where
        it says none. Raises Unusable where it says neither a yaw rate nor a force."""
        rate = _axes(message.angular_velocity, message.angular_velocity_covariance, LARGEST.rate)
        force = _axes(
            message.linear_acceleration, message.linear_acceleration_covariance, LARGEST.force
        )
        if self._is_turned:
            rate, force = self._turned(rate), self._turned(force)
        if not math.isfinite(rate[2]) and not math.isfinite(force[0]):
            raise Unusable("it measures neither a yaw rate nor a force that can be")
        return rate, force

    def _turned(self, values: Triple) -> Triple:
        x, y, z = (sum(part * values[place] for place, part in row) for row in self._parts)
        return x, y, z


def rotation(rpy: Sequence[float]) -> Array:
    """From axes that are turned by roll, pitch and yaw [rad] to those that they are turned
    against, (3, 3): R_z(yaw) R_y(pitch) R_x(roll), as in a URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_of(matrix: Array) -> Triple:
    """Roll, pitch and yaw [rad] of a rotation, (3, 3)."""
    pitch = math.asin(min(max(-float(matrix[2, 0]), -1.0), 1.0))
    if math.cos(pitch) < _NONE:  # roll and yaw turn about one axis
        return 0.0, pitch, math.atan2(-float(matrix[0, 1]), float(matrix[1, 1]))
    roll = math.atan2(float(matrix[2, 1]), float(matrix[2, 2]))
    return roll, pitch, math.atan2(float(matrix[1, 0]), float(matrix[0, 0]))


def _axes(vector: Any, covariance: Sequence[float], largest: float) -> Triple:
    # A covariance that begins with -1 says that the quantity is not measured.
    if len(covariance) and float(covariance[0]) == -1.0:
        return _UNKNOWN
    values = (float(vector.x), float(vector.y), float(vector.z))
    if any(abs(value) > largest for value in values if math.isfinite(value)):
        return _UNKNOWN
    x, y, z = (value if math.isfinite(value) else math.nan for value in values)
    return x, y, z
