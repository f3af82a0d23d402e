"""What effects remember from tick to tick: winding heat, the monitors' lag, heading and angle.

Each state is made only for a robot whose description has the effect; all are cleared with the
stage. Ticks follow each other without holes, so a tick's period is the step of every state.
"""

from collections import deque
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.encoders import WheelEstimate
from tomr_power_model.physics.effects import COPPER, Effect, WheelState, acting
from tomr_power_model.physics.effects.electrical import WindingHeating
from tomr_power_model.physics.effects.friction import TorqueRipple
from tomr_power_model.physics.model import PhysicalModel, WheelMotion

Array = NDArray[np.float64]


class Windings:
    """Temperature of the windings above 25 C.

    T' = (thermal_resistance * copper loss - T) / time_constant, exact for a loss that is constant
    over a tick.
    """

    def __init__(self, heating: WindingHeating, model: PhysicalModel, period_s: float) -> None:
        self._heating = heating
        self._cold = model.resistance
        self._keep = _decay(period_s, heating.time_constant)
        self.clear()

    @classmethod
    def of(cls, model: PhysicalModel, period_s: float) -> Self | None:
        """Of a robot, None if its windings do not heat up."""
        heating = (effect for effect in model.effects if isinstance(effect, WindingHeating))
        return next((cls(effect, model, period_s) for effect in heating), None)

    def clear(self) -> None:
        """Back to the temperature that the description begins with."""
        self.warm = self._heating.initial  # K, (3,)

    def heat(self, measured: Array, commanded: Array) -> None:
        """Take a tick's mean squared motor currents [A^2], (3,).

        Those from the encoders count where they are known, else those from the command; NaN in
        both counts as no current.
        """
        squared = np.nan_to_num(np.where(np.isnan(measured), commanded, measured))
        loss = self._cold * (1.0 + COPPER * self.warm) * squared
        settled = self._heating.thermal_resistance * loss
        self.warm = settled + self._keep * (self.warm - settled)


class Monitors:
    """What the wheels' monitors make of the wheels' power, in tick means.

    First they follow with their lag, exactly for a power that is constant over each tick; then
    the means are late by the clocks' offset, between ticks by interpolation; last come scale and
    bias. An offset into the future cannot be predicted and counts as none.
    """

    def __init__(self, effects: Sequence[Effect], period_s: float) -> None:
        hooks = acting(effects)
        still = np.zeros(3)
        lag = np.asarray(sum((effect.lag() for effect in hooks["lag"]), still))
        delay = np.asarray(sum((effect.delayed() for effect in hooks["delayed"]), still))
        self._keep = _decay(period_s, lag)
        self._mean_keep = lag / period_s * (1.0 - self._keep)  # mean of the decay over a tick
        late = np.maximum(delay, 0.0) / period_s
        self._whole = np.floor(late).astype(np.intp)
        self._part = late - self._whole
        self._reported = hooks["reported"]
        self._length = int(self._whole.max()) + 2
        self.clear()

    @classmethod
    def of(cls, effects: Sequence[Effect], period_s: float) -> Self | None:
        """Of a robot, None if its monitors are faultless."""
        hooks = acting(effects)
        flawed = any(hooks[name] for name in ("reported", "lag", "delayed"))
        return cls(effects, period_s) if flawed else None

    def clear(self) -> None:
        """Forget what was seen: what a late monitor shows next is not known."""
        self._followed = np.full(3, np.nan)
        unknown = [np.full(3, np.nan)] * self._length
        self._means = deque(unknown, maxlen=self._length)  # newest first

    def shown(self, power: Sequence[float]) -> list[float]:
        """The next tick's mean power as the monitors show it [W]; NaN where it is not known."""
        given = np.asarray(power, dtype=np.float64)
        gap = np.where(np.isnan(self._followed), 0.0, self._followed - given)
        self._followed = given + self._keep * gap
        self._means.appendleft(given + self._mean_keep * gap)
        means = np.array(self._means)
        wheels = np.arange(3)
        earlier = np.where(self._part > 0.0, means[self._whole + 1, wheels], 0.0)
        value = (1.0 - self._part) * means[self._whole, wheels] + self._part * earlier
        for effect in self._reported:
            value = effect.reported(value)
        found: list[float] = value.tolist()
        return found


class Surroundings:
    """Torques from where the robot is: its heading on a slope, the angle of its wheels.

    The heading is that against the start, summed up from yaw rates. A wheel whose angle is not
    known has no ripple.
    """

    def __init__(self, model: PhysicalModel, period_s: float, steps: int) -> None:
        self._floor = acting(model.effects)["floor_force"]
        self._ripples = _ripples(model)
        self._model = model
        self._period = period_s
        self.needs_angle = bool(self._ripples)
        # Middles of the parts of a tick, counted from its middle [s], (steps, 1).
        self._instants = period_s * ((np.arange(steps) + 0.5) / steps - 0.5)[:, None]
        self.clear()

    @classmethod
    def of(cls, model: PhysicalModel, period_s: float, steps: int) -> Self | None:
        """Of a robot, None if it is the same everywhere; `steps` are the parts of a tick."""
        found = acting(model.effects)["floor_force"] or _ripples(model)
        return cls(model, period_s, steps) if found else None

    def clear(self) -> None:
        """The next tick is the start."""
        self._heading = 0.0  # rad
        self._yaw_rate = np.nan  # rad/s

    def turn(self, expected: WheelMotion | None) -> None:
        """Go on to the next tick, turning as was measured or else as expected."""
        rate = self._yaw_rate
        if np.isnan(rate) and expected is not None:
            rate = self._turning(expected.speed.mean(axis=0))
        self._heading += float(np.nan_to_num(rate)) * self._period

    def motion(self, estimate: WheelEstimate, resisting: Array) -> WheelMotion:
        """Measured motion in the parts of a tick."""
        speed = self._speed(estimate)
        acceleration = np.broadcast_to(estimate.acceleration, speed.shape)
        return WheelMotion(speed, acceleration, resisting=resisting)

    def _speed(self, estimate: WheelEstimate) -> Array:
        return np.asarray(estimate.speed + estimate.acceleration * self._instants)

    def torque(self, estimate: WheelEstimate, angle: Array, gyro: float) -> Array:
        """Torque that resists besides in the parts of a tick [N m], (steps, 3).

        Args:
            estimate: motion of the wheels at the middle of the tick.
            angle: of the wheels there [rad], (3,), NaN where not known.
            gyro: its yaw rate [rad/s]; NaN: as the wheels say.
        """
        self._yaw_rate = self._turning(estimate.speed) if np.isnan(gyro) else gyro
        middle = self._heading + 0.5 * self._period * float(np.nan_to_num(self._yaw_rate))
        resisting = np.tile(self._slope(middle), (len(self._instants), 1))
        if self._ripples:
            resisting += self._ripple(estimate, angle)
        return resisting

    def _turning(self, speed: Array) -> float:
        return float(self._model.body.to_twist[2] @ speed)

    def _slope(self, heading: float) -> Array:
        body = self._model.body
        force = np.zeros(3)
        for effect in self._floor:
            force[:2] -= effect.floor_force(np.array(body.mass), np.array([heading]))
        return np.asarray(body.from_force @ force)

    def _ripple(self, estimate: WheelEstimate, angle: Array) -> Array:
        at = angle + self._instants * (0.5 * (self._speed(estimate) + estimate.speed))
        model, still = self._model, np.zeros_like(at)
        state = WheelState(
            still, model.body.normal, still, model.wheel_radius, model.gear_ratio, angle=at
        )
        found = sum((effect.moving_torque(state) for effect in self._ripples), still)
        return np.asarray(np.nan_to_num(found))


def _ripples(model: PhysicalModel) -> tuple[TorqueRipple, ...]:
    return tuple(effect for effect in model.effects if isinstance(effect, TorqueRipple))


def _decay(period_s: float, time_constant: Array) -> Array:
    """exp(-period / time constant), (3,); 0 where there is none."""
    slow = time_constant > 0.0
    rate = np.divide(period_s, time_constant, out=np.full(3, np.inf), where=slow)
    return np.asarray(np.exp(-rate))
