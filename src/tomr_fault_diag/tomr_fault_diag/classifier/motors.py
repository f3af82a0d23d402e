"""What the power or the current of a motor says of its wheel."""

import math

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import Unit
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_UNKNOWN = float("nan")


class Motors:
    """A robot's motors and wheels, as its description has them."""

    def __init__(self, robot: Robot) -> None:
        numbers = laid_out(vehicle_of(robot))
        wheels = wheel_records(numbers)
        self.constant = wheels[:, at.CONSTANT]  # N m/A at the wheel
        self.resistance = wheels[:, at.RESISTANCE]  # ohm
        self.load = wheels[:, at.LOAD]  # N
        self.radius = wheels[:, at.RADIUS]  # m
        self.voltage = robot.supply.nominal_voltage
        self.reports_currents = robot.measurement.quantity == "motor_current"
        self.reports_signs = robot.measurement.signed
        body = Body.of(robot)
        self.to_twist = body.to_twist
        self.from_force = body.from_force  # the body's force to wheel torques
        self.to_force = np.linalg.pinv(body.from_force)
        self._numbers = numbers.tolist()
        self._laws = plain(tuple(robot.physics))
        self.mass = body.mass  # kg
        self.per_newton = self.mass * self.from_force  # of 1 N/kg and 1 N m/kg [N m]
        # What a motor shows that is not driven, W or A.
        self.idle = np.zeros(WHEELS) if self.reports_currents else self._idle()

    def friction(self, speed: float) -> Array:
        """Of each axle at a speed [N m]."""
        still = np.zeros(WHEELS)
        return self.radius * np.abs(self.forces(still, still + speed, still))

    def _idle(self) -> Array:
        """What drivers draw that feed no motor."""
        out = [0.0] * (WHEELS * at.POWER_WHEEL)
        still = np.zeros(WHEELS)
        self._laws.drive_power(self._numbers, _motion(still, still), out, WHEELS)
        return np.array(out[at.POWER_DRAWN :: at.POWER_WHEEL])

    def scale_of(self, unit: Unit) -> float:
        """What is measured in a unit times this is in W, or in A of the motor where that is
        measured: a supply's current comes without its voltage."""
        return self.voltage if unit == "A" and not self.reports_currents else 1.0

    def currents(self, power: Array, speed: Array, way: Array) -> Array:
        """That drive the wheels forwards or backwards [A], of powers [W] at speeds [rad/s]."""
        both = self.both_currents(power, speed)
        return np.where(way < 0.0, both[:, 0], both[:, 1])

    def both_currents(self, drawn: Array, speed: Array) -> Array:
        """The two that leave a motor drawing so much [A], (3, 2): backwards and forwards of the
        least power [W]. Where currents are measured [A] both are the measured one."""
        if self.reports_currents:
            return np.column_stack([drawn, drawn])
        both = [0.0] * (2 * WHEELS)
        motion = _motion(speed, np.zeros(WHEELS))
        self._laws.motor_currents(self._numbers, motion, drawn.tolist(), both, WHEELS)
        return np.array(both).reshape(WHEELS, 2)

    def either_current(self, drawn: Array, speed: Array) -> Array:
        """The same, (3, 2); where only the size of a current is measured, either sign of it."""
        both = self.both_currents(drawn, speed)
        is_sign_known = self.reports_signs or not self.reports_currents
        return both if is_sign_known else both * [-1.0, 1.0]

    def per_torque(self, speed: Array, current: Array) -> Array:
        """How what is measured grows with the torque, at wheel speeds and currents [W/(N m)], or
        [A/(N m)]."""
        return self.per_current(speed, current) / self.constant

    def per_current(self, speed: Array, current: Array) -> Array:
        """The same with the current [W/A]; 1 where currents are measured."""
        if self.reports_currents:
            return np.ones(WHEELS)
        return self.constant * speed + 2.0 * self.resistance * current

    def noise(self, robot: Robot) -> float:
        """Standard deviation of one measurement, its resolution included [W], or [A]."""
        noise = math.hypot(robot.sensors.current_noise, robot.sensors.current_resolution)
        return noise if self.reports_currents else noise * self.voltage

    def forces(self, current: Array, speed: Array, change: Array) -> Array:
        """That wheels hand to the floor [N], at speeds and their change [rad/s^2]."""
        out = [0.0] * (2 * WHEELS)
        motion = _motion(speed, change)
        self._laws.tractions(self._numbers, motion, current.tolist(), out, WHEELS)
        return np.array(out[::2])


def _motion(speed: Array, change: Array) -> list[float]:
    """A row of motion, as the inverse dynamics take it."""
    row = [_UNKNOWN, _UNKNOWN]
    for turning, faster in zip(speed.tolist(), change.tolist(), strict=True):
        row += [turning, faster, _UNKNOWN, 0.0, 0.0, _UNKNOWN]
    return row
