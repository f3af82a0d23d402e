"""Resistance at the wheel axle: friction and iron loss."""

from typing import ClassVar

import numpy as np
from attrs import frozen

from tomr_power_model.physics.effects.base import Array, Effect, WheelState, effect


@effect("friction.coulomb")
@frozen
class Coulomb(Effect):
    """tau = torque * sign(omega)."""

    torque: Array  # N m

    def dry_torque(self, state: WheelState) -> Array:
        return self.torque


@effect("friction.viscous")
@frozen
class Viscous(Effect):
    """tau = coefficient * omega."""

    coefficient: Array  # N m s/rad

    def viscous(self, gear_ratio: Array) -> Array:
        return self.coefficient


@effect("friction.stribeck")
@frozen
class Stribeck(Effect):
    """tau = torque * exp(-(omega/speed)^2) * sign(omega), above Coulomb."""

    varies: ClassVar[bool] = True

    torque: Array  # N m
    speed: Array  # rad/s

    def dry_torque(self, state: WheelState) -> Array:
        return np.asarray(self.torque * np.exp(-((state.speed / self.speed) ** 2)))


@effect("friction.asymmetric")
@frozen
class Asymmetric(Effect):
    """A torque added to the resistance when omega > 0, taken from it when omega < 0."""

    varies: ClassVar[bool] = True

    torque: Array  # N m

    def dry_torque(self, state: WheelState) -> Array:
        return np.asarray(self.torque * np.sign(state.speed))


@effect("friction.load_dependent")
@frozen
class LoadDependent(Effect):
    """tau = coefficient * |transmitted torque| * sign(omega): gear meshing loss."""

    varies: ClassVar[bool] = True

    coefficient: Array

    def dry_torque(self, state: WheelState) -> Array:
        return np.asarray(self.coefficient * np.abs(state.transmitted))


@effect("friction.quadratic")
@frozen
class Quadratic(Effect):
    """tau = coefficient * omega * |omega|."""

    varies: ClassVar[bool] = True

    coefficient: Array  # N m s^2/rad^2

    def moving_torque(self, state: WheelState) -> Array:
        return np.asarray(self.coefficient * state.speed * np.abs(state.speed))


@effect("contact.rolling_resistance")
@frozen
class RollingResistance(Effect):
    """tau = coefficient * N_i * wheel_radius * sign(omega)."""

    needs_load: ClassVar[bool] = True

    coefficient: Array

    def dry_torque(self, state: WheelState) -> Array:
        return np.asarray(self.coefficient * state.wheel_radius * state.normal)


@effect("contact.roller_drag")
@frozen
class RollerDrag(Effect):
    """A force coefficient * N_i against the sliding of wheel i's contact.

    With slip 0 the contact slides along its axle only: the contract's effect. A wheel that turns
    faster than it travels slides in its rolling direction too; `slip` is (r omega - v) / v with
    the travel v. Dry friction points against the whole sliding, so that along the axle acts

        coefficient N_i u / sqrt(u^2 + (slip r omega)^2)

    with u the sliding along the axle [m/s] as the wheels tell it; the rest is part of traction.
    """

    needs_load: ClassVar[bool] = True

    coefficient: Array
    slip: Array

    def axle_drag(self, normal: Array) -> Array:
        return np.asarray(self.coefficient * normal)

    def axle_slip(self) -> Array:
        return self.slip


@effect("contact.slip")
@frozen
class Slip(Effect):
    """Traction of a wheel limited to friction * N_i.

    Only the simulation of the closed loop slides: what is told from the wheels' motion alone
    takes them for rolling.
    """

    needs_load: ClassVar[bool] = True

    friction: Array

    def grip(self) -> Array:
        return self.friction


@effect("electrical.iron_loss")
@frozen
class IronLoss(Effect):
    """hysteresis * |motor speed| + eddy * motor speed^2, acting as a torque of the rotor."""

    hysteresis: Array  # W s/rad
    eddy: Array  # W s^2/rad^2

    def dry_torque(self, state: WheelState) -> Array:
        return np.asarray(self.hysteresis * state.gear_ratio)

    def viscous(self, gear_ratio: Array) -> Array:
        return np.asarray(self.eddy * gear_ratio**2)


@effect("drivetrain.torque_ripple")
@frozen
class TorqueRipple(Effect):
    """tau = torque * sin(order * theta + phase), theta the wheel angle; opposes positive motion."""

    varies: ClassVar[bool] = True

    torque: Array  # N m
    order: Array  # 1/rev
    phase: Array  # rad

    def moving_torque(self, state: WheelState) -> Array | float:
        if state.angle is None:
            return 0.0
        return np.asarray(self.torque * np.sin(self.order * state.angle + self.phase))
