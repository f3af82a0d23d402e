"""Power of the drives from the motion of the wheels: inverse dynamics on arrays."""

from typing import Protocol, Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


@frozen
class WheelMotion:
    """Motion of the wheels, arrays of shape (k, n)."""

    speed: Array  # rad/s
    acceleration: Array  # rad/s^2
    # Of a gyro [rad/s], (k,); NaN or None: as the wheels say.
    yaw_rate: Array | None = None


@frozen
class DrivePower:
    """What the drives deliver and draw; arrays of shape (k, n)."""

    torque: Array  # of the motor, at the wheel [N m]
    current: Array  # motor current [A]
    voltage: Array  # at the motor terminals [V]
    power: Array  # drawn from the supply, negative when it returns [W]
    # Of computer and sensors [W], (k,); None: supply.auxiliary_power of the description.
    other: Array | None = None


class PowerModel(Protocol):
    """Anything that predicts the drives' power from the wheels' motion."""

    def power(self, motion: WheelMotion) -> DrivePower:
        """Power of each drive for each row of the motion."""
        ...


@frozen
class InverseDynamics:
    """Inverse dynamics of one robot, see `dynamics.inverse`; compiled where numba is installed."""

    numbers: Array

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Of a description."""
        return cls(laid_out(vehicle_of(robot)))

    def power(self, motion: WheelMotion) -> DrivePower:
        """Power of each drive; what depends on place, time and past is left out."""
        count, wheels = motion.speed.shape
        rows = np.zeros((count, at.MOTION_HEADER + wheels * at.MOTION_WHEEL))
        rows[:, at.MOTION_YAW] = np.nan if motion.yaw_rate is None else motion.yaw_rate
        rows[:, at.MOTION_HEADING] = np.nan
        own = rows[:, at.MOTION_HEADER :].reshape(count, wheels, at.MOTION_WHEEL)
        own[..., at.MOTION_SPEED] = motion.speed
        own[..., at.MOTION_ACCELERATION] = motion.acceleration
        own[..., at.MOTION_ANGLE] = own[..., at.MOTION_VOLTAGE] = np.nan
        out = np.empty((count, wheels * at.POWER_WHEEL))
        compiled().drive_powers(self.numbers, rows, out, wheels)
        found = out.reshape(count, wheels, at.POWER_WHEEL)
        return DrivePower(
            torque=found[..., at.POWER_TORQUE],
            current=found[..., at.POWER_CURRENT],
            voltage=found[..., at.POWER_VOLTAGE],
            power=found[..., at.POWER_DRAWN],
        )
