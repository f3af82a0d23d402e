"""The state with which the filter begins, and how it finds out that it began wrongly."""

import math

import numpy as np

from tomr_odometry.creep import Creep
from tomr_odometry.estimate import SLIDES
from tomr_odometry.hindsight import Inputs
from tomr_odometry.kernel import (
    ACCELEROMETER,
    AW,
    AX,
    AY,
    CREEP,
    GYRO,
    RIM,
    SIZE,
    SLOPE,
    VX,
    VY,
    WZ,
    YAW,
    Array,
    Noise,
    X,
    Y,
)
from tomr_odometry.standstill import Felt, Standstill
from tomr_power_model.robot import WHEELS

REST = 0.3  # s of standstill, in which an IMU shows its biases
_SLOPING = 3.0  # s of standstill: no slide lasts so long, and what no bias would do is a slope
_ONSET = 0.2  # s, in which coarse encoders count as well if the wheels begin to turn
DOUBTED = 5.0  # s, over which a velocity that turns out wrong is taken to have been so at most
_INCREDIBLE = 2.5  # standard deviations of a bias


def start(n: Noise, creep: Creep) -> tuple[Array, Array]:
    """At rest, at the origin; state and covariance."""
    x, std = np.zeros(SIZE), np.zeros(SIZE)
    x[CREEP] = creep.mean
    std[VX : WZ + 1] = n.start_twist
    std[[AX, AY]], std[AW] = n.rate, n.turn_rate
    std[ACCELEROMETER : ACCELEROMETER + 2] = n.accelerometer_bias
    std[GYRO] = n.gyro_bias
    std[SLOPE : SLOPE + 2] = n.slope
    std[CREEP] = creep.uncertainty or n.creep
    return x, np.diag(std**2)


def is_incredible(x: Array, n: Noise) -> bool:
    """Whether the biases are beyond what an IMU has: they stand for a motion that was none."""
    off = np.abs(x[ACCELEROMETER : ACCELEROMETER + 2]) / n.accelerometer_bias
    return max(float(off.max()), abs(float(x[GYRO])) / n.gyro_bias) > _INCREDIBLE


def start_again(
    n: Noise, creep: Creep, state: tuple[Array, Array], since: float
) -> tuple[Array, Array]:
    """What is left where the wheels misled for some seconds, `since`; state and covariance.

    The velocity may be wrong altogether, and with it the way of that time.
    """
    (was, doubt), (x, P) = state, start(n, creep)
    speed = float(np.hypot(was[VX], was[VX + 1])) + n.start_twist
    x[:AX] = was[:AX]
    x[RIM : RIM + WHEELS] = was[RIM : RIM + WHEELS]
    P[:VX, :VX] = doubt[:VX, :VX]
    for place, std in ((X, speed * since), (Y, speed * since), (VX, speed), (VX + 1, speed)):
        P[place, place] += std**2
    return x, P


def rested(x: Array, P: Array, n: Noise, felt: Felt) -> tuple[Array, Array]:
    """After a standstill in which the IMU felt nothing but its biases; state and covariance.

    What had been made of the IMU before is forgotten: the robot may have slid then.
    """
    x, P = x.copy(), P.copy()
    known = [*range(VX, AW + 1), *range(ACCELEROMETER, SLOPE + 2)]
    x[known] = 0.0
    P[known] = P[:, known] = 0.0
    felt_by = [GYRO, ACCELEROMETER, ACCELEROMETER + 1]
    x[felt_by] = felt.mean
    noise = np.array([n.gyro, n.accelerometer, n.accelerometer]) ** 2 / felt.samples
    # What a slope makes it feel, it is not off by.
    c, s = math.cos(x[YAW]), math.sin(x[YAW])
    into = np.zeros((SIZE, 2))
    into[SLOPE : SLOPE + 2] = np.eye(2)
    into[ACCELEROMETER : ACCELEROMETER + 2] = [[c, s], [-s, c]]
    P += n.slope**2 * into @ into.T
    P[felt_by, felt_by] += noise
    P[[VX, VY, WZ], [VX, VY, WZ]] = n.start_twist**2
    P[[AW, AX, AY], [AW, AX, AY]] = noise
    return x, P


class Beginning:
    """The first standstill, which shows the IMU's biases: until then wheels may slide."""

    def __init__(self, creep: Creep) -> None:
        self._creep, self._standstill = creep, Standstill(REST)
        self.has_stood = False
        self._is_over = False
        self._unsteady = 0.0  # s, for which the robot has not felt the same while its wheels stand
        self._trusted = 0.0  # s, since the state was doubted last

    def step(
        self, state: tuple[Array, Array], mode: Array, given: Inputs, rest: float, is_carried: bool
    ) -> tuple[Array, Array]:
        """After a step of the filter; `mode` in place; state and covariance.

        rest: for how long the wheels have stood [s].
        """
        # As long as the wheels stand the robot may still begin to slide.
        self._is_over |= self.has_stood and rest <= REST
        if self._is_over:
            return state
        self._trusted += given.dt
        felt = self._felt(given, rest, is_carried)
        is_steady = felt is not None and felt.is_steady
        if felt is not None and is_steady and not self.has_stood:
            at_rest = rested(*state, given.noise, felt)
            if rest > _SLOPING or not is_incredible(at_rest[0], given.noise):
                self.has_stood = True
                mode[:] = 0.0
                return at_rest
        self._unsteady = self._unsteady + given.dt if felt is not None and not is_steady else 0.0
        is_sliding = self._unsteady > _ONSET  # the wheels stand, and the robot does not
        was_sure = is_sliding and mode[:3].min() < SLIDES
        is_wrong = not self.has_stood and is_incredible(state[0], given.noise)
        self.has_stood &= not is_sliding
        if was_sure or is_wrong:
            state = start_again(given.noise, self._creep, state, min(self._trusted, DOUBTED))
            self._trusted = 0.0
        if is_sliding or is_wrong:
            mode[:] = 1.0
        return state

    def _felt(self, given: Inputs, rest: float, is_carried: bool) -> Felt | None:
        if is_carried:
            self._standstill.clear()
            return None
        self._standstill.take(given.time, given.inertial)
        return self._standstill.felt(given.noise) if rest > REST else None
