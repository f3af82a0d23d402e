"""The specific force that an accelerometer measures beside the acceleration that the wheels show:
they differ where a slope pulls at the robot, or wheels slide.

What it shows of a robot that moves as described is its bias, which is learnt. One that takes
gravity off itself is not believed: it has to weigh the robot as gravity does. Nor is one that is
mounted otherwise: where it goes on differing though all is well, it has to agree with the wheels
anew while they accelerate. One that repeats itself is dead.
"""

import math
from collections import deque

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import (
    IMU_REPEATS,
    NO_ENCODERS,
    NO_IMU,
    NO_WEIGHT,
    NOT_BELIEVED,
    UNKNOWN_FORCE,
    Residual,
    rounded,
)
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.model.repeats import RepeatWatch
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import GRAVITY

Array = NDArray[np.float64]
Force = tuple[float, float, float]
Pair = tuple[Residual, Residual]

_SLOT = to_ns(0.05)  # over which accelerations are taken, at least
_KEPT = 1024  # samples, should no tick come
_ACCELERATES = 0.2  # m/s^2: less says nothing of how it is mounted
_AGREED = to_ns(0.5)  # of acceleration, in which it has to agree
_PROVEN = to_ns(2.0)  # of disagreement, that much agreement outweighs: a slide is over sooner
_WEIGHS = 2.0  # m/s^2 by which the vertical force may differ from gravity
_MOVES = 0.02  # m/s, rad/s: a robot that stands may stand on a slope
_BIAS = 0.4  # m/s^2, at most
_MOST = 600.0  # ticks, over which a bias is averaged
_UNSURE = 0.3  # m/s^2, of a band, for a bias that is not known ...
_PRIOR = 80.0  # ... and half as much after so many ticks: a slope within the bands may be in them
_REPEATS = 0.1  # share of repeats that is usual where nothing is known yet
_UNKNOWN = np.full(2, math.nan)


class AccelerometerWatch:
    """Samples of the last moments, the bias, and whether the accelerometer is believed."""

    def __init__(self, period_ns: int, lately: int) -> None:
        """`period_ns` of the ticks; `lately`: so many of them in which a change counts."""
        self._period = period_ns
        ticks = -(-_SLOT // (period_ns + 1))  # a period is rounded to whole nanoseconds
        self._window = ticks * period_ns
        self._samples: deque[tuple[int, Force]] = deque(maxlen=_KEPT)
        self._twists: deque[tuple[int, Array]] = deque(maxlen=1 + ticks)
        self._recent: deque[Array] = deque(maxlen=lately)
        self._repeats = RepeatWatch(_REPEATS)
        self._agreed, self._is_doubted = _AGREED, False  # ns so far, and whether it ever ran out
        self._bias, self._count = np.zeros(2), 0.0  # m/s^2, ticks
        self.clear()

    def clear(self) -> None:
        """Forget all samples; bias and belief stay: it is the same sensor."""
        self._samples.clear()
        self._twists.clear()
        self._recent.clear()
        self._repeats.clear()

    @property
    def is_believed(self) -> bool:
        """Whether it has agreed with the wheels for long enough since it last did not."""
        return not self._is_doubted

    def add(self, stamp_ns: int, force: Force) -> None:
        """Take a sample newer than those before [m/s^2]."""
        self._samples.append((stamp_ns, force))
        self._repeats.take(stamp_ns, force)

    def residuals(self, tick_ns: int, twist: Array, bands: BandSettings, *, is_well: bool) -> Pair:
        """What it measures at a tick less what the wheels show along x and y [m/s^2], of the twist
        that they show, (3,); unknown until it is believed.

        `is_well`: whether all motors and wheels are within their bands, so that no slope pulls.
        """
        acceleration = self._acceleration(tick_ns, twist)
        moves = float(np.abs(twist).max()) > _MOVES  # false where it is NaN
        shown = (acceleration / bands.along).tolist()
        force = self._force(tick_ns)
        is_weight = abs(float(force[2]) - GRAVITY) < _WEIGHS  # false where it is NaN
        if self._repeats.is_stuck(tick_ns, shown, moves=moves) and is_weight:
            return _unknown(IMU_REPEATS)
        beyond = force[:2] - acceleration if is_weight else _UNKNOWN
        least, relative, transient = bands.of_force
        band = np.maximum(least, relative * np.abs(acceleration))
        band += transient * self._spread(acceleration)
        band += _UNSURE * _PRIOR / (_PRIOR + self._count)
        found = beyond - self._bias
        if is_well:
            self._compare(beyond, acceleration, band)
        if not np.isfinite(force).all():
            return _unknown(NO_IMU)
        if not np.isfinite(found).all():
            return _unknown(NO_ENCODERS if is_weight else NO_WEIGHT)
        if not self.is_believed:
            return _unknown(NOT_BELIEVED)
        x, y = (
            Residual(rounded(off), rounded(width), rounded(model), "m/s^2")
            for off, width, model in zip(
                found.tolist(), band.tolist(), acceleration.tolist(), strict=True
            )
        )
        return x, y

    def _force(self, tick_ns: int) -> Array:
        """Mean of the time that the encoders' speeds of a tick, and of one before, span [m/s^2],
        (3,); NaN without a sample in it."""
        end = tick_ns - self._period // 2  # of which the encoders' speeds are
        samples, begin = self._samples, end - self._window
        while samples and samples[0][0] <= begin:
            samples.popleft()
        found = [force for stamp, force in samples if stamp <= end]
        return np.asarray(np.mean(found, axis=0)) if found else np.full(3, math.nan)

    def _acceleration(self, tick_ns: int, twist: Array) -> Array:
        """That the wheels show of the body along x and y [m/s^2], (2,), of its twist (3,); NaN
        where that is not known long enough."""
        twists = self._twists
        twists.append((tick_ns, twist))
        before, last = twists[0]
        if tick_ns - before != self._window:
            return _UNKNOWN
        v_x, v_y, turning = (0.5 * (twist + last)).tolist()
        change = (twist - last)[:2] * (1e9 / self._window)
        return np.asarray(change + turning * np.array([-v_y, v_x]))

    def _spread(self, acceleration: Array) -> Array:
        """How far it moved lately along x and y [m/s^2], (2,)."""
        if not np.isfinite(acceleration).all():
            return np.zeros(2)
        self._recent.append(acceleration)
        return np.asarray(np.ptp(np.array(self._recent), axis=0))

    def _compare(self, beyond: Array, acceleration: Array, band: Array) -> None:
        """Take note of what the force is beyond the acceleration, where no slope pulls [m/s^2]."""
        if not np.isfinite(beyond).all() or float(np.abs(self._twists[-1][1]).max()) < _MOVES:
            return
        if (np.abs(beyond) > _BIAS + band).any():
            self._agreed = max(self._agreed - self._period, 0)
            if not self._agreed:
                self._is_doubted, self._count, self._bias = True, 0.0, np.zeros(2)
            return
        if float(np.hypot(*acceleration)) > _ACCELERATES:
            self._agreed = min(self._agreed + self._period, _PROVEN)
            self._is_doubted = self._is_doubted and self._agreed < _AGREED
        self._count = min(self._count + 1.0, _MOST)
        self._bias += (np.clip(beyond, -_BIAS, _BIAS) - self._bias) / (_PRIOR + self._count)


def _unknown(missing: str) -> Pair:
    unknown = evolve(UNKNOWN_FORCE, missing=missing)
    return unknown, unknown
