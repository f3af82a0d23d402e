"""Wheel speeds where encoders come more rarely than ticks: beside the motion that is expected.

A fit to three samples, a tenth of a second apart each, says next to nothing of a wheel that brakes
in two tenths. How far the wheels are from where they are expected changes slowly: that is fitted.
"""

import numpy as np

from tomr_power_model.messages.intake import Triple
from tomr_power_model.model.commanded import SimulatedMotion
from tomr_power_model.model.encoders import EncoderWindow, WheelEstimate


class ExpectedMotion:
    """The wheels' angles as the model has them, from its speeds tick by tick."""

    def __init__(self, period_ns: int) -> None:
        """`period_ns` of the ticks."""
        self._period = period_ns
        self.clear()

    def clear(self) -> None:
        """Forget all ticks."""
        self._motion = SimulatedMotion()
        self._first = self._last = 0  # ns
        self._angles = np.zeros(3)

    def estimate(self, tick_ns: int, speed: Triple, encoders: EncoderWindow) -> WheelEstimate:
        """The wheels' motion in the window that ends at a tick, in which they are expected to turn
        at `speed` [rad/s], NaN where that is not known.

        Encoders that come often enough, or begin before what is expected, show it alone.
        """
        self._add(tick_ns, speed)
        since = encoders.slow_since(tick_ns)
        if since is None or self._last != tick_ns or since < self._first:
            return encoders.at(tick_ns)
        measured, _ = encoders.beside(tick_ns, self._motion)
        return measured

    def _add(self, tick_ns: int, speed: Triple) -> None:
        if any(value != value for value in speed):
            self.clear()
            return
        begin = tick_ns - self._period
        if self._last != begin:
            self.clear()
            self._first = begin
            self._motion.add(begin, self._angles.tolist(), list(speed))
        self._angles = self._angles + 1e-9 * self._period * np.array(speed)
        self._motion.add(tick_ns, self._angles.tolist(), list(speed))
        self._last = tick_ns
