"""Wheels that slid while they were taken for gripping: found against the IMU, and taken back.

A slide that sets in slowly is no surprise to a filter that follows the wheels from step to step.
It is one against what the IMU alone has made of the velocity of some tenths of a second ago. From
there the filter goes through the same samples again, with the wheel sliding.
"""

import math
from collections import deque
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.kernel import (
    ACCELEROMETER,
    GYRO,
    SLOPE,
    VX,
    VY,
    YAW,
    Flags,
    Noise,
    step,
)
from tomr_odometry.rims import Rims
from tomr_power_model.robot import WHEELS
from tomr_power_model.slides.body import ContactBody

Array = NDArray[np.float64]
_NONE = np.zeros(WHEELS, dtype=bool)


class HindsightSettings(NamedTuple):
    """How far back, and from which difference on a wheel has slid."""

    back: float = 0.35  # s
    apart: float = 5.0  # standard deviations
    least: float = 0.01  # m/s, of them at least
    look: float = 0.015  # s, at least, from one look to the next
    silence: float = 0.05  # s of the IMU, after which nothing is known


class Inputs(NamedTuple):
    """What a step of the filter is given."""

    time: float  # s
    dt: float  # s
    noise: Noise
    used: Array  # how fast each wheel creeps per unit of creep [m/s], (3,)
    rims: Array  # ways by the encoders [m] and their variances, (2, 3)
    inertial: Array  # angular rates [rad/s] and specific forces [m/s^2], (6,)


class Moment(NamedTuple):
    """The filter before a step, what that is given, and what the IMU shows up to then."""

    x: Array
    P: Array
    mode: Array
    given: Inputs
    before: tuple[float, float]  # of velocity since some moment, odometry frame [m/s]
    gained: tuple[float, float]  # the same after the step
    turning: float  # rad/s


class Hindsight:
    """The last moments of the filter."""

    def __init__(self, body: ContactBody, settings: HindsightSettings | None = None) -> None:
        self._body, self._set = body, settings or HindsightSettings()
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._moments: deque[Moment] = deque()
        self._gained, self._turning = (0.0, 0.0), 0.0
        self._silent = 0.0  # s, of the IMU
        self._looked = 0.0  # s

    def take(self, x: Array, P: Array, mode: Array, given: Inputs) -> None:
        """Keep the filter as it is before a step."""
        self._silent += given.dt
        before = self._gained
        rate, fx, fy = given.inertial[2:5].tolist()
        if math.isfinite(rate) and math.isfinite(fx) and math.isfinite(fy):
            bias_x, bias_y, drift, pull_x, pull_y = x[ACCELEROMETER : SLOPE + 2].tolist()
            c, s, ax, ay = math.cos(x[YAW]), math.sin(x[YAW]), fx - bias_x, fy - bias_y
            vx, vy = before
            vx += self._silent * (c * ax - s * ay + pull_x)
            vy += self._silent * (s * ax + c * ay + pull_y)
            self._gained, self._silent, self._turning = (vx, vy), 0.0, rate - drift
        elif self._silent > self._set.silence:
            self._moments.clear()
        turning = self._turning
        self._moments.append(Moment(x.copy(), P, mode.copy(), given, before, self._gained, turning))
        while len(self._moments) > 2 and self._moments[1].given.time <= given.time - self._set.back:
            self._moments.popleft()

    def slid(self, rims: Rims) -> Flags:
        """Wheels whose rims turn otherwise than the ground goes by, by the IMU since `back`."""
        first, now = self._moments[0], self._moments[-1].given.time
        elapsed = now - first.given.time
        if elapsed < 0.8 * self._set.back or now - self._looked < self._set.look:
            return _NONE
        self._looked = now
        moments = reversed(self._moments)
        window = list(takewhile(lambda one: one.given.time >= rims.since, moments))
        ground = 0.5 * (self._ground(first, window[-1]) + self._ground(first, window[0]))
        apart = np.abs(rims.speed - ground)
        return np.asarray(apart > self._set.apart * np.sqrt(self._variance(first, elapsed, rims)))

    def _ground(self, first: Moment, one: Moment) -> Array:
        """How fast the ground goes by after a moment's step, by the IMU since the first began."""
        vx, vy = first.x[VX : VY + 1].tolist()
        c, s = math.cos(first.x[YAW]), math.sin(first.x[YAW])
        east = c * vx - s * vy + one.gained[0] - first.before[0]
        north = s * vx + c * vy + one.gained[1] - first.before[1]
        c, s = math.cos(one.x[YAW]), math.sin(one.x[YAW])
        twist = np.array([c * east + s * north, c * north - s * east, one.turning])
        return np.asarray(self._body.rows @ twist)

    def _variance(self, first: Moment, elapsed: float, rims: Rims) -> Array:
        """Of what the IMU says of each rim after so many seconds [m^2/s^2]."""
        rows, P, n = self._body.rows, first.P, first.given.noise
        velocity = 0.5 * (P[VX, VX] + P[VY, VY]) + P[ACCELEROMETER, ACCELEROMETER] * elapsed**2
        velocity += n.accelerometer**2 * first.given.dt * elapsed
        turning = n.gyro**2 + P[GYRO, GYRO]
        along = rows[:, 0] ** 2 + rows[:, 1] ** 2
        counts = rims.blur**2 / 6.0 + self._set.least**2
        return np.asarray(along * velocity + rows[:, 2] ** 2 * turning + counts)

    def again(self, slid: Flags) -> tuple[Array, Array, Array]:
        """The filter after the same steps with wheels that slide: state, covariance, modes."""
        moments = list(self._moments)
        x, P, mode = moments[0].x.copy(), moments[0].P, moments[0].mode.copy()
        self.clear()
        for one in moments:
            given = one.given
            self.take(x, P, mode, given)
            P = step(x, P, self._body, given.noise, mode, given.used, given.dt,
                     given.rims, given.inertial, slid)  # fmt: skip
        return x, P, mode
