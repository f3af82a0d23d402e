"""Ways and speeds of the rims, and how exactly encoders measure them."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.ticks import to_ns

Array = NDArray[np.float64]
_WINDOW_NS = to_ns(0.05)  # over which a rim's speed is taken
_FROZEN_NS = to_ns(1.0)  # how long encoders that should count may not, and be waited for
_FROZEN_COUNTS = 4.0  # that they should have counted
_COARSEST, _SMALLEST = 2.0 * math.pi / 64, 1e-7  # rad, of the encoders' quantum
_STANDING_COUNTS = 1.5
_STANDING = 0.3  # s, after which wheels stand
_SLOW = 0.02  # s between samples, from which they are looked at for uneven timing
_UNEVEN_SHARE = 0.05  # of a new sample in the mean


class Rims:
    """The encoder samples of the last moments."""

    def __init__(self, radius: Array) -> None:
        self._radius = radius
        self._last: deque[tuple[int, Array]] = deque()
        self._passed: deque[tuple[int, Array]] = deque()  # m, ways of the ground under each contact
        self._first = np.zeros(len(radius))
        self._quantum = _COARSEST  # rad
        self._turned = np.zeros(len(radius))  # rad, between the last two samples
        self._uneven = 0.0  # m^2
        self._stood = (0, self._first)  # since when, and where
        self._is_abrupt = False  # no wheel stops within a sample: the encoders may be frozen

    @property
    def time(self) -> int:
        """Of the last sample [ns], 0: none yet."""
        return self._last[-1][0] if self._last else 0

    @property
    def since(self) -> float:
        """When the samples begin that `speed` is taken over [s]."""
        return 1e-9 * self._last[0][0]

    @property
    def speed(self) -> Array:
        """Of each rim over the last samples [m/s]."""
        (first, old), (last, new) = self._last[0], self._last[-1]
        return (new - old) / max(1e-9 * (last - first), 1e-3) * self._radius

    @property
    def sliding(self) -> Array:
        """Of each rim over the ground, in the time that its speed is taken over [m/s]."""
        if len(self._passed) < 2:
            return np.zeros(len(self._radius))
        (first, old), (last, new) = self._passed[0], self._passed[-1]
        return self.speed - (new - old) / max(1e-9 * (last - first), 1e-3)

    @property
    def blur(self) -> Array:
        """What counts leave open of the speeds [m/s]."""
        (first, _), (last, _) = self._last[0], self._last[-1]
        return self._quantum / max(1e-9 * (last - first), 1e-3) * self._radius

    @property
    def rest(self) -> float:
        """For how long no wheel has turned by more than a count [s]."""
        return 1e-9 * (self.time - self._stood[0])

    @property
    def stands(self) -> bool:
        """Whether the wheels stand: for longer than encoders are frozen, if it came abruptly."""
        return self.rest > (1e-9 * _FROZEN_NS if self._is_abrupt else _STANDING)

    def is_frozen(self, time: int, angle: Array) -> bool:
        """Whether encoders repeat themselves although the wheels should have turned on.

        Counts repeat where a robot has come to rest as well: wheels that have been braking are
        taken to brake on.
        """
        if time - self.time > _FROZEN_NS or not np.array_equal(angle, self._last[-1][1]):
            return False
        (first, old), (last, new) = self._last[0], self._last[-1]
        stamp, middle = self._last[len(self._last) // 2]
        earlier = np.abs(middle - old).max() / max(stamp - first, 1)
        later = np.abs(new - middle).max() / max(last - stamp, 1)
        braking = max(float(earlier - later), 0.0) / max(0.5 * (last - first), 1.0)
        turned = float(later) * (time - last)
        if braking > 0.0:
            turned = min(turned, 0.5 * float(later) ** 2 / braking)
        return turned > _FROZEN_COUNTS * self._quantum

    def take(self, time: int, angle: Array, jitter: float) -> Array:
        """Way of each rim since the first sample [m], and its variance for a standard deviation of
        the samples' times [s]; (2, 3)."""
        if not self._last:
            self._first = angle
            self._stood = (time, angle)
            self._last.append((time, angle))
            return np.zeros((2, len(angle)))
        elapsed, turned = 1e-9 * (time - self.time), angle - self._last[-1][1]
        self._count(turned)
        if np.abs(angle - self._stood[1]).max() > _STANDING_COUNTS * self._quantum:
            self._stood, self._is_abrupt = (time, angle), False
        self._is_abrupt |= self.is_frozen(time, angle)
        variance = (self._quantum * self._radius) ** 2 / 12.0
        variance = variance + (jitter * turned * self._radius / elapsed) ** 2
        if elapsed > _SLOW:  # by second differences
            second = float(np.mean(((turned - self._turned) * self._radius) ** 2)) / 6.0
            self._uneven += _UNEVEN_SHARE * (second - self._uneven)
            variance = variance + self._uneven
        self._turned = turned
        self._last.append((time, angle))
        while len(self._last) > 2 and self._last[1][0] <= time - _WINDOW_NS:
            self._last.popleft()
        return np.array([(angle - self._first) * self._radius, variance])

    def passes(self, ground: Array) -> None:
        """The ground goes by the contacts at so many m/s at the time of the last sample."""
        time = self.time
        if not self._passed:
            self._passed.append((time, np.zeros(len(ground))))
        before, way = self._passed[-1]
        if time == before:  # the IMU goes on without the encoders
            return
        self._passed.append((time, way + 1e-9 * (time - before) * ground))
        while len(self._passed) > 2 and self._passed[0][0] < self._last[0][0]:
            self._passed.popleft()

    def _count(self, turned: Array) -> None:
        """Learn the encoders' quantum: ways are multiples of it, and so are their differences."""
        steps = np.abs(np.concatenate([turned, turned - self._turned]))
        self._quantum = min([self._quantum, *steps[steps > _SMALLEST].tolist()])
