"""Parity of a motor's voltage, power and speed.

    v = R i + k omega

The law of its driver says the voltage v, its power the current i at the speed omega that its
encoder shows. Where the three agree the motor has what its driver gives, and turns as its encoder
shows. Where they do not, a signal is lost or counts are, or a winding or the power sensor is off:
slip, slopes, loads and bearings change the current, but not the voltage that goes with it.

A driver that was at its limit has summed up what nobody knows: until the three agree again its law
does not say its voltage. One that does not know its supply gives as much less as that is low.
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    SPEEDS,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_SLOPE = 1e-3  # W/A
_NEVER = np.iinfo(np.int64).max


@frozen
class ParitySettings:
    """When it is said to hold, and to be broken. A band is what the voltage and the power of a
    healthy motor leave open of it [V]."""

    lasts: int = to_ns(0.15)  # for which it has to be so
    gap: int = to_ns(0.3)  # between ticks, after which nothing is known of those before
    holds: float = 1.0  # bands, by which it may be off, ...
    shows: float = 12.0  # ... where the speed takes so many: a fifth of its counts is a quarter
    broken: float = 3.0  # bands, by which it is off, ...
    share: float = 0.15  # ... and of the voltage that the speed takes
    remembered: int = to_ns(10.0)  # since it was broken, unless it holds again
    saturated: float = 0.9  # of the supply: a driver gives no more, whatever its law says


def _nowhere() -> Flags:
    return np.zeros(WHEELS, dtype=np.bool_)


@frozen
class Parity:
    """Of each motor, (3,); neither where it is not known."""

    holds: Flags = field(factory=_nowhere)
    broken: Flags = field(factory=_nowhere)  # or was of late
    breaks: Flags = field(factory=_nowhere)  # and did hold before


NOT_KNOWN = Parity()


class ParityWatch:
    """Looks at one tick after the other."""

    def __init__(self, robot: Robot, settings: ParitySettings | None = None) -> None:
        self.settings = settings or ParitySettings()
        self._motors = Motors(robot)
        self.clear()

    def clear(self) -> None:
        """Nothing was seen."""
        # Since when each holds, agrees while the wheel turns, and is broken [ns].
        self._since = np.full((3, WHEELS), _NEVER)
        self._until = np.zeros(WHEELS, dtype=np.int64)  # ns, for which a break is remembered
        self._is_known = _nowhere()  # whether its driver's law says a motor's voltage
        self._newest = 0  # ns

    def take(self, frame: ResidualFrame) -> Parity:
        """What the newest tick says with those before."""
        now, s = frame.stamp_ns, self.settings
        if now - self._newest > s.gap:
            self._since[:], self._is_known[:] = _NEVER, False
        self._newest = now
        off, band, takes, volts = self._of(frame)
        supply = frame.supply if math.isfinite(frame.supply) else 1.0
        obeys = volts < s.saturated * self._motors.voltage * min(supply, 1.0)
        agrees = obeys & (off < s.holds * band)
        beyond = off - volts * abs(1.0 - supply)
        differs = obeys & (beyond > np.maximum(s.broken * band, s.share * takes))
        flags = [agrees & (takes > s.shows * band), agrees & (takes > band), differs]
        self._since = np.where(flags, np.minimum(self._since, now), _NEVER)
        holds, agreed, broken = self._since <= now - s.lasts
        self._until[broken] = now + s.remembered
        self._until[holds] = 0
        self._is_known = (self._is_known | agreed) & obeys
        return Parity(holds, self._until > now, self._is_known & broken)

    def _of(self, frame: ResidualFrame) -> tuple[Array, Array, Array, Array]:
        """By how much it is off in one tick, its band, what the speed takes, and what the driver
        gives [V]."""
        motors = self._motors
        powers = [frame.residuals[index] for index in ENCODERS]
        speed = np.array([measured_speed(frame.residuals[index]) for index in SPEEDS])
        volts = _of_all(frame.voltages)
        scale = motors.scale_of(powers[0].unit)
        drawn = scale * _of_all(powers)
        takes = motors.constant * speed
        currents = motors.both_currents(drawn, speed)
        if motors.reports_currents and not motors.reports_signs:
            currents = currents * [-1.0, 1.0]
        both = volts[:, None] - takes[:, None] - motors.resistance[:, None] * currents
        nearer = np.argmin(np.abs(both), axis=1)
        off, current = np.abs(both[range(WHEELS), nearer]), currents[range(WHEELS), nearer]
        slope = np.maximum(np.abs(motors.per_current(speed, current)), _LEAST_SLOPE)
        band = np.array([item.band for item in frame.voltages])
        widths = scale * np.array([item.band for item in powers])
        band += motors.resistance * widths / slope
        return off, band, np.abs(takes), np.abs(volts)


def _of_all(items: Sequence[Residual]) -> Array:
    """What was measured."""
    return np.array([item.modelled + item.residual for item in items])
