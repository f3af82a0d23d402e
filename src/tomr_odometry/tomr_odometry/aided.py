"""Steps of the filter where an IMU shows what the wheels do not."""

import math

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.estimate import SLIDES
from tomr_odometry.hindsight import Hindsight, Inputs
from tomr_odometry.kernel import (
    ACCELEROMETER,
    CREEP,
    SIZE,
    SLOPE,
    SURE,
    VX,
    VY,
    WZ,
    YAW,
    X,
    Y,
    correct,
    step,
)
from tomr_odometry.rims import Rims
from tomr_odometry.start import DOUBTED
from tomr_power_model.robot import WHEELS
from tomr_power_model.slides.body import ContactBody

Array = NDArray[np.float64]
_CALM_TIME = 0.1  # s, over which the IMU is averaged
_CALM_FORCE, _CALM_TURNING = 0.1, 0.02  # m/s^2, rad/s: no sliding wheel brakes a body that little
_REGAINED = 3.0  # times as fast as it is lost
_STANDING = 0.3  # s of both, after which a robot stands whose wheels do
_STANDS = 0.01  # m/s, rad/s: how surely
_NONE = np.zeros(WHEELS, dtype=bool)
_NO_IMU = np.full(6, np.nan)


def mean_of(samples: list[tuple[float, ...]]) -> Array:
    """Of IMU samples since the last step, one as a rule: (6,), NaN where there is none."""
    if len(samples) == 1:
        return np.array(samples[0])
    return np.asarray(np.mean(samples, axis=0)) if samples else _NO_IMU


class Aided:
    """The filter's steps with an IMU, wheels that slid unnoticed, and a robot that stands."""

    def __init__(self, body: ContactBody) -> None:
        self._body, self._hindsight = body, Hindsight(body)
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._hindsight.clear()
        self._felt = [0.0, 0.0, 0.0]  # m/s^2, m/s^2, rad/s, less what the robot would feel at rest
        self._calm = 0.0  # s
        self._lost = 0.0  # s, since all wheels gripped
        self._unknown = 0.0  # s, for which the biases have not been known
        self._adrift = 0.0  # s, for which the velocity has been the accelerometer's
        self._spread = 0.0  # m, what its bias made of that
        self.drift = 0.0  # m/s, the same of the velocity

    def step(
        self, x: Array, P: Array, mode: Array, given: Inputs, rims: Rims, *,
        is_known: bool,
    ) -> Array:  # fmt: skip
        """Go on by a step; `x` and `mode` in place; the covariance.

        is_known: the IMU's biases, from a standstill, and that the robot is not carried.
        """
        self._hindsight.take(x, P, mode, given)
        P = step(x, P, self._body, given.noise, mode, given.used, given.dt,
                 given.rims, given.inertial, _NONE)  # fmt: skip
        self._feel(x, given)
        if not is_known:
            self._hindsight.clear()
        else:
            slid = self._hindsight.slid(rims) & (mode[:3] < SLIDES)
            if slid.any():
                x[:], P, mode[:] = self._hindsight.again(slid)
            if rims.stands and self._calm > _STANDING:
                P = self._stand(x, P, mode)
        is_sliding = bool(mode[:3].max() > SLIDES)
        self._lost = self._lost + given.dt if is_sliding else 0.0
        # Until a standstill has shown the biases, what is taken for one may be a motion.
        self._unknown = 0.0 if is_known else self._unknown + given.dt
        biases = x[ACCELEROMETER : ACCELEROMETER + 2]
        off = float(P[ACCELEROMETER, ACCELEROMETER]) + (0.0 if is_known else float(biases @ biases))
        is_adrift = is_sliding or 0.0 < self._unknown < DOUBTED
        return self._go_adrift(P, is_adrift, math.sqrt(off), given.dt)

    def _go_adrift(self, P: Array, is_adrift: bool, off: float, dt: float) -> Array:
        """While wheels slide, what the bias is off by adds up; returns the covariance.

        A wheel that slid and seems to grip makes the filter sure of the velocity. It may as well be
        one that slides along just as fast as the filter is wrong, so this stands beside it.
        off: what the accelerometer's bias may be off by, standard deviation [m/s^2].
        """
        self._adrift = max(self._adrift + (dt if is_adrift else -_REGAINED * dt), 0.0)
        self.drift = self._adrift * off
        if self._adrift == 0.0:
            self._spread = 0.0
            return P
        before, self._spread = self._spread, self._spread + self.drift * dt
        P = P.copy()
        for place in (X, Y):
            P[place, place] += self._spread**2 - before**2
        return P

    def _feel(self, x: Array, given: Inputs) -> None:
        """Whether the robot neither speeds up nor turns."""
        fx, fy, turning = given.inertial[[3, 4, 2]].tolist()
        bias_x, bias_y, drift, sx, sy = x[ACCELEROMETER : SLOPE + 2].tolist()
        c, s = math.cos(x[YAW]), math.sin(x[YAW])
        felt = fx - bias_x + c * sx + s * sy, fy - bias_y + c * sy - s * sx, turning - drift
        if all(map(math.isfinite, felt)):
            share = 1.0 - math.exp(-given.dt / _CALM_TIME)
            pairs = zip(self._felt, felt, strict=True)
            self._felt = [was + share * (new - was) for was, new in pairs]
        x_force, y_force, rate = self._felt
        is_calm = math.hypot(x_force, y_force) < _CALM_FORCE and abs(rate) < _CALM_TURNING
        self._calm = self._calm + given.dt if is_calm else 0.0

    def _stand(self, x: Array, P: Array, mode: Array) -> Array:
        """Wheels at rest would brake a body that slid on: as nothing does, it stands.

        A velocity that says otherwise was wrong, and so was the way of that time.
        """
        speed = math.hypot(x[VX], x[VY])
        if speed > 3.0 * math.sqrt(P[VX, VX] + P[VY, VY] + _STANDS**2):
            P = P.copy()
            for place, off in ((X, self._lost), (Y, self._lost), (VX, 1.0), (VY, 1.0)):
                P[place, place] += (speed * min(off, DOUBTED)) ** 2
            self._hindsight.clear()  # it looks back on that velocity
        self._adrift = 0.0
        mode[:3] = 1.0 - SURE
        rows, twist = np.eye(SIZE)[VX : WZ + 1], x[VX : WZ + 1]
        return correct(x, P, rows, -twist, np.full(3, _STANDS**2), math.inf, CREEP)
