"""Wheels that slide: a contact transmits no more than its friction times its load.

While all wheels roll, body and wheels move as one, as `many` has it. Where that would take more
traction F than friction N, body and wheels are integrated apart, in short steps:

    J omega' = torque - friction - r F,   M nu' = D^T F - c(nu) - drag + slope,   |F_i| <= mu_i N_i

D the driving directions of the wheels, F what makes  r omega - D nu  vanish if it can.
"""

from typing import Self

import numpy as np
from attrs import define
from numpy.typing import NDArray

from tomr_power_model.physics.model import STICKING_SLIDE

Array = NDArray[np.float64]
Cells = tuple[NDArray[np.intp], NDArray[np.intp]]  # variants and stretches, each (m,)

_STEPS = 3  # in one of the rolling robot
_SWEEPS = 4  # after the forces with which all wheels would roll
_ROLLS = 1e-4  # m/s: slower than this a wheel does not slide


@define
class Sliding:
    """Body motion of v variants in c stretches whose wheels may slide."""

    grip: Array  # friction of the contacts, (v, 1, 3)
    radius: Array  # m, (v, 1, 3)
    directions: Array  # D^T, (v, 3, 3)
    lightness: Array  # M^-1 transposed, (v, 3, 3)
    inertia: Array  # of wheel and rotor at the axle [kg m^2], (v, 1, 3)
    damping: Array  # N m s/rad of the wheels, motors included, (v, 1, 3)
    to_twist: Array  # of rolling wheels, transposed, (v, 3, 3)
    turning: Array  # c(nu) = omega_z turning^T nu, (v, 3, 3)
    axles: Array  # (3, 2)
    duration: float  # of a step of the rolling robot [s]
    twist: Array  # (v, c, 3)
    change: Array  # of the twist in time, (v, c, 3)
    slides: NDArray[np.bool_]  # whether any wheel does, (v, c)

    @classmethod
    def of(
        cls,
        grip: Array,
        radius: Array,
        to_twist: Array,
        mass_matrix: Array,
        inertia: Array,
        damping: Array,
        turning: Array,
        axles: Array,
        duration: float,
        speed: Array,
    ) -> Self:
        """From robots whose wheels roll at first with `speed` [rad/s], (v, c, 3)."""
        directions = np.linalg.inv(to_twist) * radius
        return cls(
            grip=grip,
            radius=radius,
            directions=directions,
            lightness=np.asarray(np.linalg.inv(mass_matrix).transpose(0, 2, 1)),
            inertia=inertia,
            damping=damping,
            to_twist=to_twist,
            turning=turning,
            axles=axles,
            duration=duration,
            twist=speed @ to_twist,
            change=np.zeros_like(speed),
            slides=np.zeros(speed.shape[:2], dtype=np.bool_),
        )

    def step(
        self,
        before: Array,
        rolling: Array,
        torque: Array,
        dry: Array,
        held: Array,
        normal: Array,
        drag: Array,
        slope: Array,
    ) -> tuple[Array, Array, Array]:
        """Wheel speeds after a step, their means, and the mean yaw rate.

        Args:
            before: wheel speeds [rad/s], (v, c, 3).
            rolling: after the step, did all wheels roll.
            torque: of the motors at standstill, less what resists [N m].
            dry: limits of dry friction at the axles [N m].
            held: dry friction of the rolling robot [N m].
            normal: wheel loads [N].
            drag: limits of the rollers' drag along the axles [N].
            slope: force of the floor on the body [N, N, N m].
        """
        mean = 0.5 * (before + rolling)
        speeding = self.inertia * (rolling - before) / self.duration
        needed = (torque - self.damping * mean - held - speeding) / self.radius
        apart = self.slides | np.any(np.abs(needed) > self.grip * normal, axis=-1)
        start, after = self.twist, rolling @ self.to_twist
        yaw = 0.5 * (start + after)[..., 2]
        if apart.any():
            variants, stretches = np.nonzero(apart)
            cells = variants, stretches
            rolling = rolling.copy()
            wide = [np.broadcast_to(item, before.shape)[cells] for item in (torque, dry, normal)]
            body = [np.broadcast_to(item, before.shape)[cells] for item in (drag, slope)]
            rolling[cells], after[cells], mean[cells], yaw[cells] = self._apart(
                cells, before[cells], *wide, *body
            )
            gap = np.abs(self.radius * rolling - after @ self.directions)
            self.slides = apart & np.any(gap > _ROLLS, axis=-1)
        self.twist = after
        self.change = (after - start) / self.duration
        return rolling, mean, yaw

    def _apart(
        self,
        cells: Cells,
        speed: Array,
        torque: Array,
        dry: Array,
        normal: Array,
        drag: Array,
        slope: Array,
    ) -> tuple[Array, Array, Array, Array]:
        """Wheel speeds and twist after a step, mean wheel speeds and yaw rate; rows are cells."""
        variant, h = cells[0], self.duration / _STEPS
        directions, lightness = self.directions[variant], self.lightness[variant]
        turning, radius = self.turning[variant], self.radius[variant, 0]
        decay = np.exp(-h * self.damping / self.inertia)[variant, 0]
        gain = (1.0 - decay) / self.damping[variant, 0]
        # What a force along each driving direction does to the twist in a short step.
        pulled = h * np.einsum("mtw,mts->mws", directions, lightness)
        coupling = pulled @ directions
        diagonal = np.arange(coupling.shape[1])
        coupling[:, diagonal, diagonal] += radius**2 * gain
        own, solved = coupling[:, diagonal, diagonal], np.linalg.inv(coupling)
        limit, twist = self.grip[variant, 0] * normal, self.twist[cells]
        stuck = np.zeros_like(speed)
        mean, yaw = np.zeros_like(speed), np.zeros(len(speed))
        for _ in range(_STEPS):
            first, before = speed, twist[:, 2]
            speed = decay * speed + gain * (torque - stuck)
            resists = twist[:, 2:] * _times(twist, turning) - slope
            along = np.tanh(twist[:, :2] @ self.axles.T / STICKING_SLIDE)
            resists[:, :2] += (drag * along) @ self.axles
            twist = twist - h * _times(resists, lightness)
            gap = radius * speed - _times(twist, directions)
            more = force = np.clip(_times(gap, solved), -limit, limit)
            for sweep in range(_SWEEPS):
                if sweep:
                    gap = radius * speed - _times(twist, directions)
                    more = np.clip(force + gap / own, -limit, limit) - force
                    force = force + more
                twist = twist + _times(more, pulled)
                speed = speed - gain * radius * more
                more = np.clip(stuck + speed / gain, -dry, dry) - stuck
                stuck = stuck + more
                speed = speed - gain * more
            mean += 0.5 / _STEPS * (first + speed)
            yaw += 0.5 / _STEPS * (before + twist[:, 2])
        return speed, twist, mean, yaw


def _times(rows: Array, matrices: Array) -> Array:
    """Each row times its matrix, (m, 3)."""
    return np.asarray((rows[:, None, :] @ matrices)[:, 0])
