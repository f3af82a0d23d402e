"""An IMU that repeats itself bit for bit while the wheels change what it should measure.

Its driver may go on after the sensor died, with the last reading or with zeros. Believed, that is
a body that goes on as it did while all wheels slide.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.repeats import RepeatWatch
from tomr_power_model.model.ticks import to_ns

_REPEATS = 0.1  # share of repeats that is usual where nothing is known yet
_CHANGES = np.array([0.1, 0.1, 0.1])  # m/s, m/s, rad/s: less may not show in a coarse reading
_MOVES = 0.02  # m/s, rad/s
_EVERY = to_ns(0.02)  # between two looks at the wheels


class StuckImu:
    """Follows the readings of an IMU beside the twist that the wheels show."""

    def __init__(self, to_twist: NDArray[np.float64]) -> None:
        """`to_twist`: (3, n), from the rims' speeds to the body's twist."""
        self._to_twist = to_twist
        self._watch = RepeatWatch(_REPEATS)
        self._looked = 0  # ns
        self._is_stuck = False

    def take(self, stamp_ns: int, values: Sequence[float]) -> bool:
        """Take angular rates [rad/s] and specific forces [m/s^2], NaN for what is not measured;
        returns whether they say nothing of the robot."""
        self._watch.take(stamp_ns, tuple(value for value in values if value == value))
        return self._is_stuck or not any(values)

    def look(self, stamp_ns: int, rims: NDArray[np.float64]) -> bool:
        """Hold the readings up to a time against the rims' speeds there [m/s], (n,); returns
        whether they are found to repeat themselves now."""
        if stamp_ns - self._looked < _EVERY:
            return False
        self._looked = stamp_ns
        twist = self._to_twist @ rims
        moves = float(np.abs(twist).max()) > _MOVES
        was_stuck = self._is_stuck
        self._is_stuck = self._watch.is_stuck(stamp_ns, (twist / _CHANGES).tolist(), moves=moves)
        return self._is_stuck and not was_stuck
