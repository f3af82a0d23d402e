"""Electrical power of the three motors from the motion of the wheels."""

from functools import cached_property
from typing import Protocol, Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.physics.body import Body
from tomr_power_model.physics.effects import COPPER, Effect, WheelState, acting, effects_of
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

# Below this wheel speed [rad/s] dry friction fades instead of jumping with the encoder's noise.
_STICKING_SPEED = 0.1
# As above for the sliding of a contact along its axle [m/s].
STICKING_SLIDE = 0.005
_NO_SLIDE = 1e-12  # keeps the direction of no sliding defined


@frozen
class WheelMotion:
    """Motion of the wheels, arrays of shape (n, 3)."""

    speed: Array  # rad/s
    acceleration: Array  # rad/s^2
    # Of a gyro [rad/s], (n,); NaN or None: as the wheels say.
    yaw_rate: Array | None = None
    # What the surroundings and the past do; None: nothing.
    resisting: Array | None = None  # torque that resists besides [N m], (n, 3)
    warm: Array | None = None  # winding temperature above 25 C [K], (3,)


@frozen
class DrivePower:
    """What the drives deliver and draw; arrays of shape (n, 3)."""

    torque: Array  # of the motor, at the wheel [N m]
    current: Array  # motor current [A]
    voltage: Array  # at the motor terminals [V]
    power: Array  # drawn from the supply, negative when it returns [W]
    # Of computer and sensors [W], (n,); None: supply.auxiliary_power of the description.
    other: Array | None = None


class PowerModel(Protocol):
    """Anything that predicts the drives' power from the wheels' motion."""

    def power(self, motion: WheelMotion) -> DrivePower:
        """Power of each drive for each row of the motion."""
        ...


@frozen
class PhysicalModel:
    """Inverse dynamics, DC motors and the enabled effects.

        tau = K^-T (M nu_dot + c(nu) + drag) + J omega_dot + friction
        i = tau / k,  v = R i + k omega,  P = supplied(v i) + driver losses

    with k the torque constant at the wheel (k_e times gear ratio). What depends on place or past
    (slope, ripple, heat) comes with the motion.
    """

    body: Body
    effects: tuple[Effect, ...]
    resistance: Array  # ohm, (3,)
    constant: Array  # at the wheel [N m/A = V s/rad], (3,)
    viscous: Array  # N m s/rad, (3,)
    wheel_radius: Array  # m, (3,)
    gear_ratio: Array  # (3,)

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Model of a described robot; raises InputError for an effect without a model."""
        effects = effects_of(robot)
        changed = robot
        for effect in effects:
            changed = effect.changed(changed)
        gear = np.array([motor.gear_ratio for motor in robot.motors])
        viscous = sum((effect.viscous(gear) for effect in effects), np.zeros(3))
        return cls(
            body=Body.of(changed),
            effects=effects,
            resistance=np.array([motor.resistance for motor in robot.motors]),
            constant=np.array([motor.wheel_constant for motor in robot.motors]),
            viscous=np.asarray(viscous),
            wheel_radius=np.full(3, robot.wheel_radius),
            gear_ratio=gear,
        )

    def power(self, motion: WheelMotion) -> DrivePower:
        """Power of each drive; motion and results of shape (n, 3)."""
        torque = self._torque(motion)
        current = torque / self.constant
        resistance = self.resistance
        if motion.warm is not None:
            resistance = resistance * (1.0 + COPPER * motion.warm)
        voltage = resistance * current + self.constant * motion.speed
        return DrivePower(torque, current, voltage, self._drawn(voltage * current, current))

    def _torque(self, motion: WheelMotion) -> Array:
        body = self.body
        twist = motion.speed @ body.to_twist.T
        if motion.yaw_rate is not None:
            seen = ~np.isnan(motion.yaw_rate)
            twist[seen, 2] = motion.yaw_rate[seen]
        force = motion.acceleration @ self._inertia + body.turning_force(twist)
        if self._drags:
            force += self._drag(twist, motion.speed)
        carried = force @ body.from_force.T + motion.acceleration * body.wheel_inertia
        torque = carried + self.friction(motion.speed, carried)
        return torque if motion.resisting is None else torque + motion.resisting

    def friction(self, speed: Array, carried: Array) -> Array:
        """Resisting torque at the axles [N m]; `carried` is what the gear transmits besides."""
        dry, moving = self.resistance_at(speed, carried)
        return np.asarray(dry * np.tanh(speed / _STICKING_SPEED) + moving + self.viscous * speed)

    @cached_property
    def _inertia(self) -> Array:
        """(M K^-1)^T: wheel accelerations, as rows, to body force."""
        return np.asarray((self.body.mass_matrix @ self.body.to_twist).T)

    @cached_property
    def _drags(self) -> bool:
        return bool(np.any(self.axle_limit()))

    @cached_property
    def _acting(self) -> dict[str, tuple[Effect, ...]]:
        return acting(self.effects)

    def resistance_at(self, speed: Array, carried: Array) -> tuple[Array, Array]:
        """Limit of dry friction, and the torque that is neither dry nor viscous [N m]."""
        state = WheelState(speed, self.body.normal, carried, self.wheel_radius, self.gear_ratio)
        still = np.zeros_like(speed)
        acting = self._acting
        dry = sum((effect.dry_torque(state) for effect in acting["dry_torque"]), still)
        moving = sum((effect.moving_torque(state) for effect in acting["moving_torque"]), still)
        return np.asarray(dry), np.asarray(moving)

    def axle_limit(self) -> Array:
        """Limit of each contact's drag along its axle [N], shape (3,)."""
        normal = self.body.normal
        return np.asarray(sum((e.axle_drag(normal) for e in self.effects), np.zeros(3)))

    def rolling_slip(self) -> Array:
        """Sliding of each contact in its rolling direction per wheel speed [m], shape (3,)."""
        return self.wheel_radius * sum((e.axle_slip() for e in self.effects), np.zeros(3))

    def _drag(self, twist: Array, speed: Array) -> Array:
        """Body force against the contacts' sliding along their axles [N, N, N m], (n, 3)."""
        body = self.body
        limit = self.axle_limit()
        force = np.zeros_like(twist)
        along = twist[..., :2] @ body.axles.T
        sliding = np.maximum(np.hypot(along, self.rolling_slip() * speed), _NO_SLIDE)
        share = np.tanh(sliding / STICKING_SLIDE) * along / sliding
        force[..., :2] = (limit * share) @ body.axles
        return force

    def _drawn(self, power: Array, current: Array) -> Array:
        for effect in self._acting["supplied"]:
            power = effect.supplied(power)
        for effect in self._acting["driver_power"]:
            power = power + effect.driver_power(current)
        return power
