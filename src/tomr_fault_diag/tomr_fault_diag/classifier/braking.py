"""Whether a robot brakes to a halt that it was not asked for.

Drivers whose commands are withheld ramp their set point to zero, which takes up to a second. No
fault of a wheel and nobody who pushes slows a robot down just so. From its motion at the beginning
of a window, (v_0, w_0), braking at the drivers' limit a makes

    v(t) = v_0 max(0, 1 - a t / |v_0|);   w(t) = w_0 max(0, 1 - a t / (R |w_0|))
"""

from collections import deque

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import twist_to_wheels, wheels_to_twist
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_WINDOW = to_ns(0.3)
_FAR_FOR = to_ns(0.2)  # at one wheel at least ...
_AT_LEAST = 2  # ... and at so many now
_LEAST = 1.5  # rad/s, that a wheel must have lost
_LIKE = 0.15  # of that, by which braking may be another
_ASKED = 0.5  # of that, by which what is asked for must be another


@frozen
class _Tick:
    stamp_ns: int
    speed: Array  # of the wheels, measured [rad/s], (3,)
    far: int  # wheels that turn far otherwise than expected


class BrakingWatch:
    """Remembers the motion of a window."""

    def __init__(self, robot: Robot) -> None:
        """Of a robot; nothing is said of one whose drivers do not ramp."""
        self._limit = robot.controller.acceleration_limit
        self._radius = robot.robot_radius
        self._to_twist, self._to_wheels = wheels_to_twist(robot), twist_to_wheels(robot)
        self._ticks: deque[_Tick] = deque()

    def clear(self) -> None:
        """Forget what was seen."""
        self._ticks.clear()

    def take(self, stamp_ns: int, speed: Array, expected: Array, far: int) -> bool:
        """Whether it brakes and is not asked to.

        Args:
            stamp_ns: of the newest tick.
            speed: of the wheels, measured [rad/s], (3,), NaN where not known.
            expected: the same as the commands ask for.
            far: wheels that turn far otherwise than expected.
        """
        ticks = self._ticks
        ticks.append(_Tick(stamp_ns, speed, far))
        while len(ticks) > 1 and stamp_ns - ticks[1].stamp_ns >= _WINDOW:
            ticks.popleft()
        if far < _AT_LEAST or stamp_ns - ticks[0].stamp_ns < _WINDOW:
            return False
        if not all(tick.far for tick in ticks if stamp_ns - tick.stamp_ns <= _FAR_FOR):
            return False
        twist = self._to_twist @ ticks[0].speed
        halts = np.array([self._braked(twist, tick.stamp_ns) for tick in ticks])
        lost = float(np.abs(halts[-1] - halts[0]).max())
        off = np.abs(halts - [tick.speed for tick in ticks]).max()
        asked = np.abs(expected - halts[-1]).max()
        return bool(lost > _LEAST and off < _LIKE * lost and asked > _ASKED * lost)

    def _braked(self, twist: Array, stamp_ns: int) -> Array:
        """Speeds of the wheels at some time of the window [rad/s], (3,), had it braked."""
        lost = self._limit * (stamp_ns - self._ticks[0].stamp_ns) / NANOSECONDS
        fast, turning = float(np.hypot(twist[0], twist[1])), self._radius * abs(float(twist[2]))
        along, about = (max(0.0, 1.0 - lost / max(size, 1e-9)) for size in (fast, turning))
        return np.asarray(self._to_wheels @ (twist * [along, along, about]))
