"""Wheel speed loops of the motor drivers.

A command is held until the next, or for as long as a timeout says: then it counts as a stop, as in
drivers that watch over their master. The linear command vector moves towards it by at most
acceleration_limit * dt, the yaw rate by acceleration_limit / robot_radius * dt; wheel set speeds
follow by the nominal kinematics; the speed is that of the quantised encoder over one period; and
v = kp e + ki sum(e) dt without feed-forward, integration stopped while saturated.
"""

import math
from collections import deque

import numpy as np

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.plant.wheels import Vector, rolling_rows

COMMAND_TIMEOUT = 0.5  # s, as the diagnosis expects of a robot


class WheelDrivers:
    """Three speed loops, ticked at the controller's rate."""

    def __init__(self, robot: Robot, period: float, command_timeout: float = 0.0) -> None:
        """`period` is the control period [s]; a command older than its timeout [s] counts as a
        stop, 0: it is held.
        """
        controller = robot.controller
        self._period = period
        self._proportional = controller.proportional
        self._integral = controller.integral
        self._limit = controller.acceleration_limit
        self._yaw_limit = controller.acceleration_limit / robot.robot_radius
        self._delay_ns = round(controller.delay * NANOSECONDS)
        self._full = robot.supply.nominal_voltage
        self._rows = rolling_rows(robot) / robot.wheel_radius
        self.obedience = 1.0  # share of the commanded twist that is acted upon
        self._timeout_ns = round(command_timeout * NANOSECONDS)
        self._given_ns = 0
        self._pending: deque[tuple[int, Vector]] = deque()
        self._wanted = np.zeros(3)
        self._twist = np.zeros(3)
        self._angle = np.zeros(WHEELS)
        self._sum = np.zeros(WHEELS)

    def command(self, stamp_ns: int, twist: Vector) -> None:
        """Take a body twist (v_x, v_y [m/s], omega_z [rad/s]) given at a time."""
        self._pending.append((stamp_ns + self._delay_ns, twist))

    def tick(self, now_ns: int, angle: Vector) -> Vector:
        """Duty of the three bridges, -1..1.

        Args:
            now_ns: time of this tick [ns].
            angle: encoder angles [rad], quantised, shape (3,).
        """
        while self._pending and self._pending[0][0] <= now_ns:
            self._given_ns, self._wanted = self._pending.popleft()
        if self._timeout_ns and now_ns > self._given_ns + self._timeout_ns:
            self._wanted = np.zeros(3)
        self._ramp()
        error = self._rows @ self._twist - (angle - self._angle) / self._period
        self._angle = angle
        total = self._sum + error * self._period
        voltage = self._proportional * error + self._integral * total
        saturated = np.abs(voltage) >= self._full
        self._sum = np.where(saturated, self._sum, total)
        return np.clip(voltage / self._full, -1.0, 1.0)

    def _ramp(self) -> None:
        wanted = self._wanted * self.obedience
        if self._limit == 0.0:
            self._twist = wanted
            return
        step_x, step_y, step_yaw = wanted - self._twist
        length = math.hypot(step_x, step_y)
        share = min(1.0, self._limit * self._period / length) if length > 0 else 1.0
        most = self._yaw_limit * self._period
        turn = min(max(step_yaw, -most), most)
        self._twist = self._twist + np.array([share * step_x, share * step_y, turn])
