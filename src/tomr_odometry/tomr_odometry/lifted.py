"""A robot that is lifted, as an IMU feels it."""

import math

from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import GRAVITY

_BUMP_TIME = 0.05  # s, over which samples are averaged: a bump and wheels that chatter are no lift
_USUAL_TIME = 0.5  # s, over which a new weight would be taken for granted
_LIFTED = 1.1  # m/s^2 off the usual weight
_LIFTED_TILT = 0.4  # rad/s of rolling or pitching
_CARRIED_NS = to_ns(0.7)  # how long after such a moment the robot may still be carried


class Lifted:
    """Weight changes, or the robot rolls and pitches."""

    def __init__(self) -> None:
        self.until = 0  # stamp up to which the robot may be carried [ns]
        self._stamp = 0
        self._usual = self._weight = math.nan  # m/s^2
        self._tilting = 0.0, 0.0  # rad/s

    def take(self, stamp: int, values: tuple[float, ...]) -> None:
        """Take angular rates [rad/s] and specific forces [m/s^2], x, y and z each."""
        elapsed, self._stamp = 1e-9 * (stamp - self._stamp), stamp
        bump, usual = min(elapsed / _BUMP_TIME, 1.0), min(elapsed / _USUAL_TIME, 1.0)
        (roll, pitch), (x, y), weight = self._tilting, values[:2], values[5]
        if math.isfinite(x) and math.isfinite(y):
            self._tilting = roll + bump * (x - roll), pitch + bump * (y - pitch)
        is_heavy = False
        if math.isfinite(weight):
            before = self._usual if math.isfinite(self._usual) else weight
            felt = self._weight if math.isfinite(self._weight) else weight
            self._weight = felt + bump * (weight - felt)
            # What feels no gravity says nothing of a weight.
            is_heavy = abs(before) > 0.5 * GRAVITY and abs(self._weight - before) > _LIFTED
            self._usual = before + usual * (weight - before)
        if is_heavy or math.hypot(*self._tilting) > _LIFTED_TILT:
            self.until = stamp + _CARRIED_NS
