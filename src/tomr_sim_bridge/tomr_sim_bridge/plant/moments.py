"""What the sensors look at: the plant's state at the ends of its stretches, with a memory."""

from bisect import bisect_left
from collections import deque

import numpy as np
from attrs import frozen

from tomr_sim_bridge.plant.wheels import Vector

ENCODER = slice(0, 3)  # rad, reported, not yet quantised
POSITION = slice(3, 5)  # m in the world
YAW = 5  # rad
VELOCITY = slice(6, 9)  # m/s in the world
ANGULAR = slice(9, 12)  # rad/s in base_link
VOLTAGE = 12  # V s: integral of the bus voltage
SUPPLY_CURRENT = slice(13, 16)  # A s: integral of the drivers' supply currents
MOTOR_CURRENT = slice(16, 19)  # A s: integral of the motor currents
TOTAL_CURRENT = 19  # A s: integral of the battery's current
SLIP = slice(20, 23)  # m: integral of the slip speed of the contacts
LENGTH = 23


@frozen
class Moment:
    """State at a time; the columns are named above."""

    stamp_ns: int
    values: Vector


class Memory:
    """The moments of the last while, read at any time in between."""

    def __init__(self, first: Moment, depth_ns: int) -> None:
        """Remember for at least `depth_ns` [ns]; before the first moment nothing changes."""
        self._depth = depth_ns
        self._stamps = deque([first.stamp_ns])
        self._values = deque([first.values])

    @property
    def latest(self) -> Moment:
        return Moment(self._stamps[-1], self._values[-1])

    def append(self, moment: Moment) -> None:
        """Add the newest moment and forget what is too old."""
        self._stamps.append(moment.stamp_ns)
        self._values.append(moment.values)
        while len(self._stamps) > 2 and self._stamps[1] < moment.stamp_ns - self._depth:
            self._stamps.popleft()
            self._values.popleft()

    def at(self, stamp_ns: int) -> Vector:
        """State at a time, linear between two moments."""
        if stamp_ns >= self._stamps[-1]:
            return self._values[-1]
        after = bisect_left(self._stamps, stamp_ns)
        if after == 0:
            return self._values[0]
        low, high = self._stamps[after - 1], self._stamps[after]
        share = (stamp_ns - low) / (high - low)
        if share == 1.0:
            return self._values[after]
        return self._values[after - 1] + share * (self._values[after] - self._values[after - 1])


def blank() -> Vector:
    """A state of zeros."""
    return np.zeros(LENGTH)
