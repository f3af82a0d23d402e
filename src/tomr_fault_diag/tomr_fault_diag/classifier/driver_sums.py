"""What loads leave in the drivers' voltages.

The voltage that a driver holds beyond the simulated one rests on what the two sums of errors differ
by, and what they differed by in the beginning is forgotten, soon at first and slowly for ever
(`model/driver_law.py`). A load that lasts is so forgotten in part, for its sums do differ: when it
is over the voltage is off by as much the other way, whichever way the wheel then turns, and no
motor is the weaker for it.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.driver_law import FADES
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_TICKS = 20  # of a wheel, whose median is what stays
_LOADED = 2  # wheels whose voltages leave their bands: no fault of one wheel


class DriverSums:
    """Follows the voltages tick by tick."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Nothing has loaded the robot."""
        self._recent: list[deque[float]] = [deque(maxlen=_TICKS) for _ in range(WHEELS)]
        self._most = np.zeros(WHEELS)  # V, that loads may have left

    def take(self, volts: Array, is_outside: Flags, shows: Flags, elapsed: int) -> None:
        """Of a tick, so long [ns] after the one before.

        Args:
            volts: of each driver beyond the simulated one [V].
            is_outside: whether that leaves its band.
            shows: whether its wheel turns and the voltage is known.
        """
        self._most *= np.exp(-FADES * elapsed / NANOSECONDS)
        if (is_outside & shows).sum() >= _LOADED:
            self._most = np.where(shows, np.maximum(self._most, np.abs(volts)), self._most)
        for wheel in np.flatnonzero(shows):
            self._recent[wheel].append(float(volts[wheel]))

    @property
    def stays(self) -> Array:
        """What loads have left in each voltage, as far as is known [V], (3,)."""
        middle = [sorted(seen)[len(seen) // 2] if seen else 0.0 for seen in self._recent]
        return np.clip(middle, -self._most, self._most)
