"""Wheel angles of drivers that begin anew each turn, as the angles go on.

Many encoders' drivers give angles from -pi to pi, or from 0 to 2 pi. Which robot's do is seen from
the angles: no wheel has been outside of one turn, and a leap of about one turn goes against the
wheel's speed.
"""

import math
from collections.abc import Sequence

from attrs import define

_TURN = 2.0 * math.pi
_LEEWAY = 1e-3  # rad: angles may be of single precision
_STEP = 0.5 * math.pi  # rad, between two samples, at most: what is left without the turn


@define
class _Turning:
    """One wheel: its last angle as given, the range so far, and turns since the start [rad]."""

    last: float = math.nan
    least: float = math.inf
    most: float = -math.inf
    turned: float = 0.0

    def goes_on(self, angle: float, speed: float) -> float:
        """The angle [rad] as it goes on; `speed` of the wheel [rad/s], NaN where none is given."""
        if angle != angle:  # NaN
            return angle
        self.least, self.most = min(self.least, angle), max(self.most, angle)
        leap = angle - self.last  # NaN at first
        self.last = angle
        if self.most - self.least <= _TURN + _LEEWAY:
            turn = math.copysign(_TURN, -leap)
            # Angles that were missed go the way of the wheel, those that begin anew against it.
            is_new = abs(leap + turn) < _STEP and not turn * speed < 0.0
            self.turned += turn if is_new else 0.0
        return angle + self.turned


class Turns:
    """Follows the wheels of one stream of JointState."""

    def __init__(self, wheels: int) -> None:
        """So many wheels, from their first sample on."""
        self._wheels = [_Turning() for _ in range(wheels)]

    def go_on(self, angles: Sequence[float], speeds: Sequence[float]) -> list[float]:
        """The angles of a sample [rad] without leaps of one turn, those of a driver that makes
        none as they are; speeds [rad/s], NaN where none is given."""
        wheels = zip(self._wheels, angles, speeds, strict=True)
        return [wheel.goes_on(angle, speed) for wheel, angle, speed in wheels]
