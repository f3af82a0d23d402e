"""The model of Wang 2024 in the place of the physical one."""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics.drives import DrivePower, WheelMotion
from tomr_power_model.robot import Robot
from tomr_power_model.wang2024.coefficients import Coefficients
from tomr_power_model.wang2024.state import Chassis, state_of
from tomr_power_model.wang2024.terms import P_control, P_motion, P_sensor

Array = NDArray[np.float64]


@frozen
class Wang2024Model:
    """Power of the motors, and of what else the robot feeds, by Wang 2024, Eqs 1-17."""

    chassis: Chassis
    coefficients: Coefficients
    resistance: Array  # ohm, (3,)
    constant: Array  # at the wheel [N m/A = V s/rad], (3,)

    @classmethod
    def of(cls, robot: Robot, coefficients: Coefficients) -> Self:
        """Model of a robot; raises InputError for coefficients of another one."""
        coefficients.check(robot)
        return cls(
            chassis=Chassis.of(robot),
            coefficients=coefficients,
            resistance=np.array([motor.resistance for motor in robot.motors]),
            constant=np.array([motor.wheel_constant for motor in robot.motors]),
        )

    def power(self, motion: WheelMotion) -> DrivePower:
        """Power of each drive; motion and results of shape (n, 3)."""
        state, c = state_of(self.chassis, motion), self.coefficients
        drawn = P_motion(state, c)
        current = self._current(drawn - np.array(c.P_stanby), motion.speed)
        return DrivePower(
            torque=self.constant * current,
            current=current,
            voltage=self.resistance * current + self.constant * motion.speed,
            power=drawn,
            other=P_control(state, c) + P_sensor(state, c),
        )

    def _current(self, running: Array, speed: Array) -> Array:
        """Motor current [A] that draws a power [W]: R i^2 + k omega i = P, for robots that measure
        current. The paper has none. Of the two roots the one of less loss."""
        emf = self.constant * np.abs(speed)
        inside = np.maximum(emf**2 + 4.0 * self.resistance * running, 0.0)
        along = (np.sqrt(inside) - emf) / (2.0 * self.resistance)
        return np.asarray(np.where(speed < 0.0, -along, along))
