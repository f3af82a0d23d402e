"""Parity of a motor's voltage, power and speed.

    v = R i + k omega

The law of its driver says the voltage v, its power the current i at the speed omega that its
encoder shows. Where the three agree the motor has what its driver gives, and turns as its encoder
shows. Where they do not, a signal is lost or counts are, or a winding or the power sensor is off:
slip, slopes, loads and bearings change the current, but not the voltage that goes with it.

Drivers that obey a command later than it was given, or not at all, sum up what nobody knows: the
law of each is off by a voltage that stays, most often of several at once. Of those nothing is said
until they have agreed again for long.

A driver at its limit gives what its supply has, where that is measured. What it has summed up by
then is known to a tenth of that alone: so much more has to be off until the three agree again. One
that does not know its supply gives as much less as that is low.
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.losses import UNEXPLAINED, Losses, LossWatch, nowhere
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    SPEEDS,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.model.ticks import NEVER, to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_NOT_YET = np.iinfo(np.int64).max


@frozen
class ParitySettings:
    """When it is said to hold, and to be broken. A band is what the voltage and the power of a
    healthy motor leave open of it [V]."""

    lasts: int = to_ns(0.15)  # for which it has to be so
    gap: int = to_ns(0.3)  # between ticks, after which nothing is known of those before
    holds: float = 1.0  # bands, by which it may be off, ...
    shows: float = 12.0  # ... where the speed takes so many: a fifth of its counts is a quarter
    broken: float = 2.0  # bands, by which it is off, ...
    share: float = 0.15  # ... and of the voltage that the speed takes
    remembered: int = to_ns(10.0)  # since it was broken, unless it holds again
    stays: int = to_ns(0.5)  # for which that counts: a wheel that turns back does not show it
    saturated: float = 0.9  # of the supply: a driver gives no more, whatever its law says, ...
    doubt: float = 0.1  # ... which may be off by so much of it from then on
    alike: float = 0.3  # times as much, by which another one is off that ...
    together: int = to_ns(0.5)  # ... is off for no longer: drivers obey what is not known
    again: int = to_ns(2.0)  # for which one has to agree then, or after a limit, to be trusted
    first: int = to_ns(1.0)  # for which it has to at first
    unsettled: int = to_ns(0.35)  # for which wheels still do what nobody seems to have asked for


@frozen
class Parity:
    """Of each motor, (3,); neither where it is not known."""

    holds: Flags = field(factory=nowhere)
    broken: Flags = field(factory=nowhere)  # or was of late
    breaks: Flags = field(factory=nowhere)  # and did hold before ...
    broke: Flags = field(factory=nowhere)  # ... or broke a moment ago
    beyond: float = 0.0  # by how much those are off, in parts of what is allowed, beyond it
    misled: bool = False  # drivers obeyed what is not known, a moment ago
    losses: Losses = UNEXPLAINED  # which alone explain that it breaks


NOT_KNOWN = Parity()


class ParityWatch:
    """Looks at one tick after the other."""

    def __init__(self, robot: Robot, settings: ParitySettings | None = None) -> None:
        self.settings = settings or ParitySettings()
        self._motors = Motors(robot)
        self._losses = LossWatch(robot, self._motors)
        self.clear()

    def clear(self) -> None:
        """Nothing was seen."""
        # Since when each holds, agrees while the wheel turns, is broken, and agrees [ns].
        self._since = np.full((4, WHEELS), _NOT_YET)
        self._broken = np.full(WHEELS, NEVER)  # ns, when each last was, unless it held since
        self._is_known = nowhere()  # whether its driver's law says a motor's voltage, ...
        self._doubt = np.zeros(WHEELS)  # ... but for so much [V]
        # Whether it has agreed for long: by chance it does for a moment, where a wheel turns back.
        self._is_proven = nowhere()
        self._misled = nowhere()  # drivers that obeyed what is not known, ...
        self._misled_at = NEVER  # ... since when they do, the last time [ns]
        self._beyond = np.zeros(WHEELS)  # by how much each was off when last broken, see `Parity`
        self._newest = 0  # ns

    def take(self, frame: ResidualFrame) -> Parity:
        """What the newest tick says with those before."""
        now, s = frame.stamp_ns, self.settings
        if now - self._newest > s.gap:
            self._since[:], self._is_known[:] = _NOT_YET, False
        self._newest = now
        holds, agreed, broken = self._lasting(frame)
        self._broken[broken], self._broken[holds] = now, NEVER
        breaks = self._is_known & broken
        broke = self._is_known & ~agreed & (self._broken >= now - s.stays)
        return Parity(
            holds,
            self._broken > now - s.remembered,
            breaks,
            broke,
            beyond=float(self._beyond[broke].max(initial=0.0)),
            misled=self._misled_at > now - s.unsettled,
            losses=self._losses.take(frame, breaks),
        )

    def _lasting(self, frame: ResidualFrame) -> tuple[Flags, Flags, Flags]:
        """Where it has held for long enough, agreed while the wheel turns, and been broken."""
        now, s = frame.stamp_ns, self.settings
        is_measured = math.isfinite(frame.supply)
        supply = frame.supply if is_measured else 1.0
        off, band, takes, volts = self._of(frame)
        obeys = volts < s.saturated * self._motors.voltage * min(supply, 1.0)
        is_said = obeys | is_measured
        self._doubt[~obeys] = s.doubt * self._motors.voltage
        agrees = obeys & (off < s.holds * band)
        least = np.maximum(s.broken * band, s.share * takes) + self._doubt
        off -= volts * abs(1.0 - supply)
        differs = is_said & (off > least) & ~self._misled
        if self._obey_others(off, s.holds * band + self._doubt, differs):
            self._misled[:], self._misled_at, self._broken[:] = True, now, NEVER
            differs[:] = False
        turning = agrees & (takes > band)
        flags = [agrees & (takes > s.shows * band), turning, differs, agrees]
        self._since = np.where(flags, np.minimum(self._since, now), _NOT_YET)
        holds, agreed, broken, _ = self._since <= now - s.lasts
        self._beyond[broken] = (off / least - 1.0)[broken]
        trusted = self._since[3] <= now - s.again
        self._misled &= ~trusted
        self._doubt[trusted] = 0.0
        proven = self._since[3] <= now - s.first
        self._is_proven = (self._is_proven & ~(broken & ~self._is_known)) | proven
        self._is_known = (self._is_known | (agreed & self._is_proven)) & is_said
        return holds, agreed, broken

    def _obey_others(self, off: Array, least: Array, differs: Flags) -> bool:
        """Whether drivers obey commands that are not known: several motors are off alike, and were
        not before."""
        is_new = self._since[2] > self._newest - self.settings.together
        most = np.max(off, where=differs & is_new, initial=0.0)
        alike = is_new & (off > np.maximum(least, self.settings.alike * most))
        return bool(most > 0.0 and np.count_nonzero(alike) > 1)

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
        currents = motors.either_current(drawn, speed)
        both = volts[:, None] - takes[:, None] - motors.resistance[:, None] * currents
        nearer = range(WHEELS), np.argmin(np.abs(both), axis=1)
        band = np.array([item.band for item in frame.voltages])
        widths = scale * np.array([item.band for item in powers])
        more = motors.either_current(drawn + widths, speed)[nearer] - currents[nearer]
        band = band + motors.resistance * np.abs(more)
        return np.abs(both[nearer]), band, np.abs(takes), np.abs(volts)


def _of_all(items: Sequence[Residual]) -> Array:
    """What was measured."""
    return np.array([item.modelled + item.residual for item in items])
