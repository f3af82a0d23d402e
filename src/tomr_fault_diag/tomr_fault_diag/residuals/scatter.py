"""How far the stamps of encoder samples scatter about the motion that their angles show."""

import math
from collections import deque
from statistics import median

import numpy as np

from tomr_power_model.model.encoders import WheelEstimate

_TICKS = 20  # that moved, looked at
# Samples that scatter by so much time and, which coarse encoders do not reach, so far come in
# another order than they were taken in: no stamp can be trusted, neither those of powers.
_DISORDER = 0.015  # s
_DISORDER_ANGLE = 0.15  # rad
_MOVING = 1.0  # rad/s of the fastest wheel: speeds that can be true show that stamps are in order
_ROUNDED = 1.0 / math.sqrt(12.0)  # standard deviation of what is rounded, in counts


class ScatterWatch:
    """Remembers how the last estimates fitted their samples."""

    def __init__(self, fastest: float) -> None:
        """`fastest` that a wheel can turn [rad/s]: what seems faster was not measured then."""
        self._fastest = fastest
        self._seconds: deque[float] = deque(maxlen=_TICKS)
        self._angles: deque[float] = deque(maxlen=_TICKS)  # rad

    def clear(self) -> None:
        """Forget all estimates."""
        self._seconds.clear()
        self._angles.clear()

    def take(self, estimate: WheelEstimate) -> None:
        """Take the estimate of a tick.

        One whose scatter does not show, for encoders may give too few samples in a window, only
        outweighs one that was too fast, and at rest changes nothing.
        """
        if np.any(np.abs(estimate.speed) > self._fastest):
            self._seconds.append(math.inf)
            self._angles.append(math.inf)
        elif estimate.scatter == estimate.scatter:  # not NaN
            self._seconds.append(estimate.scatter)
            self._angles.append(estimate.scatter * float(np.linalg.norm(estimate.speed)))
        elif math.inf in self._seconds and np.any(np.abs(estimate.speed) > _MOVING):
            number = self._seconds.index(math.inf)
            del self._seconds[number], self._angles[number]

    @property
    def seconds(self) -> float:
        """Scatter of the samples' times [s], 0 where none was seen."""
        return median(self._seconds) if self._seconds else 0.0

    def counts(self, resolution: float) -> float:
        """Standard deviation that angles of a resolution [rad] have by being whole counts [rad].

        No more than they scatter about the motion: samples may step alike for other reasons.
        """
        rounded = _ROUNDED * resolution
        return min(rounded, median(self._angles)) if self._angles else rounded

    @property
    def is_disorder(self) -> bool:
        """Whether the samples come in another order than they were taken in."""
        return self.seconds > _DISORDER and median(self._angles) > _DISORDER_ANGLE
