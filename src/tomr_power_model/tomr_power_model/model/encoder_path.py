"""The encoder path: power in the motion that the encoders show, beside the simulated motion.

Inverse dynamics know a motion at one moment: not what rollers and wheels at rest hold, which came
about before it, nor how torque and speed vary within a tick. The simulation knows both, so they say
only what the difference between the two motions makes:

    P = P_simulated + inverse(measured) - inverse(simulated)

For a wheel that rests in both motions that is what the voltages differ by that the two drivers
hold, no more, and only where friction can hold it against them: how both come to rest is not known
so well. Of one that rests in the simulation alone inverse dynamics speak for themselves.
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics.inverse import STICKING_SPEED
from tomr_power_model.effects import EFFECTS
from tomr_power_model.messages.readings import NAN
from tomr_power_model.model.means import Means
from tomr_power_model.model.monitors import Monitors
from tomr_power_model.model.power_models import MeasuredMotion, TickPower
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

RESTS = 0.05  # rad/s: a slower wheel may stand still


@frozen
class Simulated:
    """What the simulation says of a tick."""

    motion: MeasuredMotion  # as it moves
    means: Means  # as the monitors show it


@frozen
class Rests:
    """Which wheels rest, (..., n)."""

    here: Mask  # in the measured motion
    there: Mask  # in the simulated one
    held: Mask  # and friction can hold them against both drivers' voltages


def beside(simulated: Array, inverse: Array, of_simulated: Array, rests: Rests) -> Array:
    """What inverse dynamics say of a motion, put right by a simulation of nearly the same.

    Args:
        simulated: what is asked for, as simulated, (..., n).
        inverse: the same by inverse dynamics, of the measured motion.
        of_simulated: and of the simulated motion.
        rests: wheels that do.
    """
    differs = np.where(rests.here & rests.there & ~rests.held, 0.0, inverse - of_simulated)
    return np.where(rests.there & ~rests.here, inverse, simulated + differs)


def alike(measured: Array, simulated: Array, rests: tuple[Mask, Mask]) -> Array:
    """A simulated motion for `beside`: a wheel that rests in both moves as measured, (..., n)."""
    here, there = rests
    return np.where(here & there, measured, simulated)


def at_rest(speed: Array) -> Mask:
    """Which wheels are so slow [rad/s] that dry friction may take any value; not if unknown."""
    return np.asarray(np.abs(speed) < STICKING_SPEED)


class EncoderPath:
    """Asks a power model about the measured motion; monitors are followed from tick to tick."""

    def __init__(self, robot: Robot, model: TickPower, period_s: float, *, is_shown: bool) -> None:
        """`is_shown`: the model was fitted to what the monitors show, and needs none."""
        self._model = model
        self._nominal = robot.supply.nominal_voltage
        self._reads_motor = robot.measurement.quantity == "motor_current"
        self._sticks = any(EFFECTS[name].dry_torque is not None for name in robot.physics)
        self._monitors = [] if is_shown else [Monitors.of(robot, period_s) for _ in range(2)]

    def clear(self) -> None:
        """Forget what the monitors follow."""
        for monitors in self._monitors:
            if monitors is not None:
                monitors.clear()

    def means(self, motion: MeasuredMotion, simulated: Simulated | None) -> Means:
        """Of a tick, as the monitors show it.

        Args:
            motion: of the wheels, as measured.
            simulated: None where no simulation can be compared.
        """
        means = self._model.measured(motion)
        shown = self._shown(means, 0)
        if simulated is None:
            self._shown(means, 1)
            return self._where_known(shown, motion)
        speeds = np.array(motion.speed), np.array(simulated.motion.speed)
        resting = at_rest(speeds[0]), at_rest(speeds[1])
        accelerations = np.array(motion.acceleration), np.array(simulated.motion.acceleration)
        other = evolve(
            simulated.motion,
            speed=alike(*speeds, resting).tolist(),
            acceleration=alike(*accelerations, resting).tolist(),
        )
        of_other = self._model.measured(other)
        off = self._shown(of_other, 1)
        rests = Rests(*resting, np.array(means.obeyed) & np.array(of_other.obeyed))

        def right(*of_tick: Sequence[float]) -> list[float]:
            first, alone, other = map(np.array, of_tick)
            found: list[float] = beside(first, alone, other, rests).tolist()
            return found

        whole = simulated.means
        return evolve(
            shown,
            current=right(whole.current, shown.current, off.current),
            at_motor=right(whole.at_motor, shown.at_motor, off.at_motor),
            power=right(whole.power, shown.power, off.power),
        )

    def _where_known(self, means: Means, motion: MeasuredMotion) -> Means:
        """NaN for a wheel at rest that may hold any torque up to its dry friction."""
        if not self._sticks or not any(math.isnan(volts) for volts in motion.held):
            return means
        known = [
            not math.isnan(volts) or abs(speed) > RESTS
            for volts, speed in zip(motion.held, motion.speed, strict=True)
        ]

        def kept(values: Sequence[float]) -> list[float]:
            return [value if sure else NAN for value, sure in zip(values, known, strict=True)]

        return evolve(
            means,
            current=kept(means.current),
            at_motor=kept(means.at_motor),
            power=kept(means.power),
        )

    def _shown(self, means: Means, which: int) -> Means:
        """As the monitors show it; those of motor currents take them for the supply's."""
        monitors = self._monitors[which] if self._monitors else None
        if monitors is None:
            return means
        if not self._reads_motor:
            return evolve(means, power=monitors.shown(means.power))
        power = monitors.shown([self._nominal * current for current in means.current])
        current = [drawn / self._nominal for drawn in power]
        volts = _voltages(means)
        at_motor = [v * i for v, i in zip(volts, current, strict=True)]
        return evolve(means, current=current, at_motor=at_motor)


def _voltages(means: Means) -> list[float]:
    """Mean terminal voltages where current flows, else 0 [V]."""
    pairs = zip(means.at_motor, means.current, strict=True)
    return [power / current if current else 0.0 for power, current in pairs]
