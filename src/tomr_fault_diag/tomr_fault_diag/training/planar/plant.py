"""A planar rigid body on three omni wheels with limited traction, many robots at once.

State per robot: twist nu in base_link, wheel speeds omega. In a step h, with the motor's damping
D = k^2/R + viscous taken by the trapezoidal rule,

    J omega_dot = k/R V - D omega - f - r lambda
    M nu_dot    = K'^T lambda - c(nu) + push,        K' = r K

f is dry friction, within +-dry and such that the wheel sticks if it can; lambda is traction, within
+-mu N and such that the contact does not slip if it can. Both are found wheel by wheel in turn
(block Gauss-Seidel, from the last step's values): the wheels are light beside the body, so a few
sweeps do.
"""

from typing import Self

import numpy as np
from attrs import define, frozen

from tomr_fault_diag.training.planar.fleet import RATE, Array, Fleet
from tomr_fault_diag.training.planar.schedule import Schedule

_SUBSTEPS = 1
_SWEEPS = 2
_TINY = 1e-12


@frozen
class Motion:
    """What the plant did, at the ends of the steps and in between; m steps, n robots."""

    encoder: Array  # reported angle, not yet quantised [rad], (m + 1, 3, n)
    power: Array  # mean drawn by each driver in a step [W], (m, 3, n)
    slip: Array  # mean of each contact in a step [m/s], (m, 3, n)


@define
class _State:
    twist: Array  # (3, n)
    speed: Array  # (3, n)
    traction: Array  # N, (3, n)
    friction: Array  # N m, (3, n)
    acceleration: Array  # m/s^2, (2, n)
    yaw: Array  # (n,)

    @classmethod
    def rest(cls, count: int) -> Self:
        def zeros() -> Array:
            return np.zeros((3, count))

        return cls(zeros(), zeros(), zeros(), zeros(), np.zeros((2, count)), np.zeros(count))


class Drivers:
    """Wheel speed loops as the contract describes them: ramp, PI, no wind-up in saturation."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._linear = fleet.acceleration / RATE
        self._yaw = self._linear / fleet.robot_radius
        self._twist = np.zeros((3, len(fleet)))
        self._integral = np.zeros((3, len(fleet)))

    def volts(self, command: Array, speed: Array) -> Array:
        """Voltages (3, n) from commanded twists and measured wheel speeds (3, n)."""
        fleet = self._fleet
        step = command - self._twist
        length = np.hypot(step[0], step[1])
        step[:2] *= np.minimum(1.0, self._linear / np.maximum(length, _TINY))
        step[2] = np.minimum(np.maximum(step[2], -self._yaw), self._yaw)
        self._twist = self._twist + step
        error = times(fleet.kinematics, self._twist) - speed
        total = self._integral + error / RATE
        wanted = fleet.proportional * error + fleet.integral * total
        volts = np.minimum(np.maximum(wanted, -fleet.voltage), fleet.voltage)
        self._integral = np.where(volts == wanted, total, self._integral)
        return volts


def times(matrices: Array, vectors: Array) -> Array:
    """Matrices (3, 3, n) by vectors (..., 3, n)."""
    return np.asarray(
        matrices[:, 0] * vectors[..., 0:1, :]
        + matrices[:, 1] * vectors[..., 1:2, :]
        + matrices[:, 2] * vectors[..., 2:3, :]
    )


class Plant:
    """Steps a fleet through a schedule."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._h = 1.0 / RATE / _SUBSTEPS
        self._rows = fleet.kinematics * fleet.wheel_radius
        # Body acceleration per traction, and slip acceleration of contact i per traction j.
        self._push = np.einsum("abn,cbn->acn", fleet.mass_inverse, self._rows)
        self._coupling = np.einsum("ian,ajn->ijn", self._rows, self._push)

    def run(self, schedule: Schedule) -> Motion:
        """Drive the whole schedule from rest."""
        fleet, count = self._fleet, len(schedule.command)
        drivers, state = Drivers(fleet), _State.rest(len(fleet))
        encoder = np.zeros((count + 1, 3, len(fleet)))
        power, slip = np.empty((2, count, 3, len(fleet)))
        quantum = fleet.encoder_resolution
        seen = np.zeros((3, len(fleet)))
        for step in range(count):
            now = np.round(encoder[step] / quantum) * quantum
            volts = drivers.volts(schedule.command[step], (now - seen) * RATE)
            seen = now
            share = schedule.drive[step]
            connected = share > 0.0
            volts *= share
            turned, slipped = self._advance(state, volts, connected, schedule, step)
            encoder[step + 1] = encoder[step] + turned * schedule.encoder[step]
            current = (volts - fleet.constant * (turned * RATE)) / fleet.resistance * connected
            power[step] = volts * current + fleet.standby
            slip[step] = slipped
        return Motion(encoder, power, slip)

    def _advance(
        self, state: _State, volts: Array, connected: Array, schedule: Schedule, step: int
    ) -> tuple[Array, Array]:
        """Turn [rad] and mean slip speed [m/s] of the wheels in one step of the drivers."""
        fleet, h = self._fleet, self._h
        drive = fleet.constant / fleet.resistance * connected
        damping = 0.5 * h * (fleet.constant * drive + fleet.viscous)
        heavy = fleet.inertia + damping
        decay, gain = (fleet.inertia - damping) / heavy, h / heavy
        torque = drive * volts
        height = fleet.load + np.einsum("ian,an->in", fleet.load_shift, state.acceleration)
        limit = h * schedule.friction[step] * np.maximum(height, 0.0)
        turned, slipped = np.zeros_like(volts), np.zeros_like(volts)
        pushed = bool(schedule.push[step].any())
        for _ in range(_SUBSTEPS):
            before, twist = state.speed, state.twist
            free_speed = decay * before + gain * torque
            force = -self._turning(twist)
            if pushed:
                force += self._push_in_body(state.yaw, schedule.push[step])
            free_twist = twist + h * times(fleet.mass_inverse, force)
            self._contacts(state, free_speed, free_twist, gain / h, limit)
            torque_impulse = state.friction + fleet.wheel_radius * state.traction
            state.speed = free_speed - gain / h * torque_impulse
            state.twist = free_twist + times(self._push, state.traction)
            state.yaw = state.yaw + 0.5 * h * (state.twist[2] + twist[2])
            rate = (state.twist - twist)[:2] / h
            turning = state.twist[2] * np.stack([-state.twist[1], state.twist[0]])
            state.acceleration = state.acceleration + 0.2 * (rate + turning - state.acceleration)
            turned += 0.5 * h * (before + state.speed)
            slipped += fleet.wheel_radius * state.speed - times(self._rows, state.twist)
        return turned, slipped / _SUBSTEPS

    def _contacts(
        self, state: _State, speed: Array, twist: Array, mobility: Array, limit: Array
    ) -> None:
        """Impulses of traction [N s] and dry friction [N m s] for free speeds and twists."""
        radius, coupling = self._fleet.wheel_radius, self._coupling
        rim = times(self._rows, twist)
        slip = radius * speed - rim
        dry = self._h * self._fleet.dry
        traction, friction = state.traction, state.friction
        for _ in range(_SWEEPS):
            for i in range(3):
                others = coupling[i, i - 1] * traction[i - 1] + coupling[i, i - 2] * traction[i - 2]
                own, give, most = coupling[i, i], mobility[i], limit[i]
                # If the wheel sticks, traction alone must hold the contact still ...
                stuck = np.minimum(np.maximum(-(rim[i] + others) / own, -most), most)
                held = np.minimum(np.maximum(speed[i] / give - radius * stuck, -dry[i]), dry[i])
                # ... otherwise friction is at its limit, and traction goes with it.
                free = (slip[i] - radius * give * held - others) / (own + radius * radius * give)
                free = np.minimum(np.maximum(free, -most), most)
                friction[i] = held
                traction[i] = np.where(np.abs(held) < dry[i], stuck, free)

    def _turning(self, twist: Array) -> Array:
        """c(nu): the omega x v terms in the body frame [N, N, N m]."""
        mass, (x, y) = self._fleet.mass, self._fleet.mass_center
        vx, vy, wz = twist
        force = np.stack([-(vy + wz * x), vx - wz * y, x * vx + y * vy])
        return np.asarray(mass * wz * force)

    @staticmethod
    def _push_in_body(yaw: Array, push: Array) -> Array:
        cosine, sine = np.cos(yaw), np.sin(yaw)
        return np.stack(
            [cosine * push[0] + sine * push[1], cosine * push[1] - sine * push[0], push[2]]
        )
