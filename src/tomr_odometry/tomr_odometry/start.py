"""The state with which the filter begins."""

import numpy as np

from tomr_odometry.creep import Creep
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
    WZ,
    Array,
    Noise,
    X,
    Y,
)
from tomr_power_model.robot import WHEELS

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
