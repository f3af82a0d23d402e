"""The drivers' closed loop: which wheel motion a command leads to.

Driver, once a control period h (contract of the recordings):

    command, delayed, ramped by acceleration_limit h (yaw: / robot_radius)  -> twist set point
    e = K twist - omega_measured;  v = k_p e + k_i sum(e) h, held over h, within +-V_supply

Plant in wheel space, exact over h for the linear part (back-EMF, viscous friction):

    M omega_dot = k/R v - D omega - c - dry friction,   D = k^2/R + viscous
    omega+ = E omega + G (k/R v - c) - G f,             E = exp(-h M^-1 D), G = int_0^h e^.. M^-1 dt

Dry friction f is the torque within +-limit that stops the wheel if it can (Coulomb's law as a
complementarity problem, solved by projected Gauss-Seidel), so a wheel sticks at standstill.
"""

import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray
from scipy.linalg import expm

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.effects import COPPER
from tomr_power_model.physics.model import STICKING_SLIDE, PhysicalModel
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Rows = tuple[Triple, Triple, Triple]

_SWEEPS = 2  # of Gauss-Seidel; the last step's friction is the first guess


@frozen
class LoopState:
    """All that the loop remembers between two steps."""

    twist: Triple = (0.0, 0.0, 0.0)  # ramped set point [m/s, m/s, rad/s]
    speed: Triple = (0.0, 0.0, 0.0)  # wheels [rad/s]
    measured: Triple = (0.0, 0.0, 0.0)  # mean speed over the last period [rad/s]
    integral: Triple = (0.0, 0.0, 0.0)  # sum(e) h [rad]
    friction: Triple = (0.0, 0.0, 0.0)  # dry friction of the last step [N m]


def _triple(values: Sequence[float] | Array) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])


def _rows(matrix: Array) -> Rows:
    return _triple(matrix[0]), _triple(matrix[1]), _triple(matrix[2])


def _dot(row: Triple, vector: Triple) -> float:
    return row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2]


def _times(rows: Rows, vector: Triple) -> Triple:
    (a, b, c), (d, e, f), (g, h, i) = rows
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _clip(value: float, limit: float) -> float:
    if value > limit:
        return limit
    return -limit if value < -limit else value


@frozen
class ClosedLoop:
    """The loop of one robot at a fixed step; plain floats: three wheels are too few for numpy."""

    step_s: float
    kinematics: Rows  # K of the driver (nominal radii)
    decay: Rows  # E
    gain: Rows  # G
    drive: Triple  # k/R at the wheel [N m/V]
    to_twist: Rows
    from_force: Rows
    proportional: float
    integral: float
    voltage: float  # limit [V]
    linear_step: float  # ramp per step [m/s]; inf: none
    yaw_step: float  # rad/s
    dry: Triple  # limits of dry friction where they do not change [N m]
    varying: bool  # whether they do
    axle_drag: tuple[float, ...]  # limits [N], empty if there is none
    rolling_slip: tuple[float, ...]  # of the contacts, per wheel speed [m]
    axles: tuple[tuple[float, float], ...]
    model: PhysicalModel = field(repr=False)

    @classmethod
    def of(cls, robot: Robot, model: PhysicalModel, step_s: float) -> Self:
        """Discretise the loop of a robot at a step [s], the driver's period or close to it."""
        inertia = model.body.wheel_mass_matrix
        drive = model.constant / model.resistance
        damping = np.diag(model.constant * drive + model.viscous)
        rate = np.linalg.solve(inertia, damping)
        decay = expm(-step_s * rate)
        # int_0^h exp(-s A) ds M^-1 = (I - E) A^-1 M^-1 = (I - E) D^-1, D is never singular.
        gain = (np.eye(3) - decay) @ np.linalg.inv(damping)
        drag = model.axle_limit().tolist()
        ramp = robot.controller.acceleration_limit * step_s or math.inf
        return cls(
            step_s=step_s,
            kinematics=_rows(twist_to_wheels(robot, nominal=True)),
            decay=_rows(decay),
            gain=_rows(gain),
            drive=_triple(drive),
            to_twist=_rows(model.body.to_twist),
            from_force=_rows(model.body.from_force),
            proportional=robot.controller.proportional,
            integral=robot.controller.integral,
            voltage=robot.supply.nominal_voltage,
            linear_step=ramp,
            yaw_step=ramp / robot.robot_radius,
            dry=_triple(model.resistance_at(np.zeros(3), np.zeros(3))[0]),
            varying=any(effect.varies for effect in model.effects),
            axle_drag=tuple(drag) if any(drag) else (),
            rolling_slip=tuple(model.rolling_slip().tolist()) if any(drag) else (),
            axles=tuple((float(x), float(y)) for x, y in model.body.axles) if any(drag) else (),
            model=model,
        )

    def moving(self, speed: Sequence[float] | Array) -> LoopState:
        """A state that drives steadily at measured wheel speeds [rad/s]."""
        wheels = _triple(speed)
        twist = _triple([_dot(row, wheels) for row in self.to_twist])
        if not any(wheels):
            return LoopState()
        dry = [math.copysign(limit, wheel) for limit, wheel in zip(self.dry, wheels, strict=True)]
        volts = [
            self.model.constant[i] * wheels[i]
            + (dry[i] + self.model.viscous[i] * wheels[i]) / self.drive[i]
            for i in range(3)
        ]
        integral = [volt / self.integral if self.integral else 0.0 for volt in volts]
        return LoopState(twist, wheels, wheels, _triple(integral), _triple(dry))

    def step(
        self,
        state: LoopState,
        command: Triple,
        resisting: Triple | None = None,
        warm: Triple | None = None,
    ) -> LoopState:
        """One step under a commanded twist (v_x, v_y [m/s], omega_z [rad/s]).

        `resisting` are torques at the wheels besides those of the model [N m], `warm` is the
        temperature of the windings above 25 C [K].
        """
        twist = self._ramped(state.twist, command)
        volts, integral = self._driver(state, twist)
        before = state.speed
        torque = self._body_torque(before)
        dry = self.dry
        if self.varying:
            dry, moving = self._resistance(state)
            torque = torque[0] + moving[0], torque[1] + moving[1], torque[2] + moving[2]
        if resisting is not None:
            x, y, z = resisting
            torque = torque[0] + x, torque[1] + y, torque[2] + z
        if warm is not None:
            x, y, z = self._lost_to_heat(volts, before, warm)
            torque = torque[0] + x, torque[1] + y, torque[2] + z
        (a, b, c), (d, e, f), (x, y, z) = self.drive, volts, torque
        load = a * d - x, b * e - y, c * f - z
        (a, b, c), (x, y, z) = _times(self.decay, before), _times(self.gain, load)
        free = a + x, b + y, c + z
        friction = self._stick_or_slide(free, state.friction, dry)
        (a, b, c), (x, y, z) = free, _times(self.gain, friction)
        speed = x, y, z = a - x, b - y, c - z
        mean = 0.5 * (x + before[0]), 0.5 * (y + before[1]), 0.5 * (z + before[2])
        return LoopState(twist, speed, mean, integral, friction)

    def _lost_to_heat(self, volts: Triple, speed: Triple, warm: Triple) -> Triple:
        """Torque that warm windings deliver less than cold ones [N m]."""
        lost = []
        for wheel, constant in enumerate(self.model.constant.tolist()):
            cold = self.drive[wheel] * (volts[wheel] - constant * speed[wheel])
            lost.append(cold - cold / (1.0 + COPPER * warm[wheel]))
        return _triple(lost)

    def _ramped(self, twist: Triple, command: Triple) -> Triple:
        dx, dy = command[0] - twist[0], command[1] - twist[1]
        length = math.hypot(dx, dy)
        part = self.linear_step / length if length > self.linear_step else 1.0
        yaw = _clip(command[2] - twist[2], self.yaw_step)
        return twist[0] + part * dx, twist[1] + part * dy, twist[2] + yaw

    def _driver(self, state: LoopState, twist: Triple) -> tuple[Triple, Triple]:
        a, b, c = _times(self.kinematics, twist)
        x, y, z = state.measured
        p, q, r = state.integral
        first, p = self._control(a - x, p)
        second, q = self._control(b - y, q)
        third, r = self._control(c - z, r)
        return (first, second, third), (p, q, r)

    def _control(self, error: float, integral: float) -> tuple[float, float]:
        """Voltage [V] and new integral [rad] of one driver; in saturation it does not wind up."""
        total = integral + error * self.step_s
        wanted = self.proportional * error + self.integral * total
        volts = _clip(wanted, self.voltage)
        return volts, total if volts == wanted else integral

    def _body_torque(self, speed: Triple) -> Triple:
        """Wheel torques of the omega x v terms and of axle drag [N m], see `physics.body`."""
        vx, vy, wz = _times(self.to_twist, speed)
        mass, (x, y) = self.model.body.mass, self.model.body.mass_center
        fx = -mass * wz * (vy + wz * x)
        fy = mass * wz * (vx - wz * y)
        moment = mass * wz * (x * vx + y * vy)
        for i, limit in enumerate(self.axle_drag):
            ax, ay = self.axles[i]
            along = ax * vx + ay * vy
            sliding = math.hypot(along, self.rolling_slip[i] * speed[i])
            if sliding > 0.0:
                drag = limit * math.tanh(sliding / STICKING_SLIDE) * along / sliding
                fx += drag * ax
                fy += drag * ay
        return _times(self.from_force, (fx, fy, moment))

    def _resistance(self, state: LoopState) -> tuple[Triple, Triple]:
        """Limits of dry friction and moving torque [N m] where they change with the motion."""
        speed = np.array(state.speed)
        dry, moving = self.model.resistance_at(speed, np.array(state.friction))
        return _triple(np.maximum(dry, 0.0)), _triple(moving)

    def _stick_or_slide(self, free: Triple, guess: Triple, dry: Triple) -> Triple:
        (a, b, c), (d, e, f), (g, h, i) = self.gain
        first, second, third = free
        x, y, z = guess
        for _ in range(_SWEEPS):
            x = _clip((first - (b * y + c * z)) / a, dry[0])
            y = _clip((second - (d * x + f * z)) / e, dry[1])
            z = _clip((third - (g * x + h * y)) / i, dry[2])
        return x, y, z
