"""What an IMU feels while the wheels stand: the same all the time, or the robot is not at rest."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.kernel import Noise

Array = NDArray[np.float64]
_PLACES = [2, 3, 4]  # of the yaw rate and of the specific forces along the floor
_APART = 4.0  # standard deviations
_FEWEST = 3  # samples, as of encoders of 10 Hz


class Felt(NamedTuple):
    """What an IMU felt over some time, on average."""

    mean: Array  # rad/s, m/s^2, m/s^2, (3,)
    samples: int
    is_steady: bool  # the same all the time


class Standstill:
    """The IMU's samples of the last moments.

    A robot that slides while its wheels stand speeds up, slows down or turns, and feels that. One
    that slides on evenly feels what one at rest feels.
    """

    def __init__(self, time: float) -> None:
        self._time = time  # s, that is looked at
        self._samples: deque[tuple[float, Array]] = deque()

    def clear(self) -> None:
        """Forget all."""
        self._samples.clear()

    def take(self, time: float, inertial: Array) -> None:
        """Take angular rates [rad/s] and specific forces [m/s^2] at a time [s], (6,)."""
        felt = inertial[_PLACES]
        if np.isfinite(felt).all():
            self._samples.append((time, felt))
        while self._samples and self._samples[0][0] < time - self._time:
            self._samples.popleft()

    def felt(self, n: Noise) -> Felt | None:
        """What was felt; None: not for long enough."""
        count = len(self._samples)
        if count < _FEWEST or self._samples[-1][0] - self._samples[0][0] < 0.8 * self._time:
            return None
        felt = np.array([one for _, one in self._samples])
        third = count // 3
        change = np.abs(felt[-third:].mean(axis=0) - felt[:third].mean(axis=0))
        noise = np.array([n.gyro, n.accelerometer, n.accelerometer])
        most = _APART * noise * math.sqrt(2.0 / third)
        return Felt(felt.mean(axis=0), count, bool((change < most).all()))
