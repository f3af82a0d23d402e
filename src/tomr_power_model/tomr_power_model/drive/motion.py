"""Motion of the wheels at any time of a recording, from encoder samples before and after it."""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import WheelMotion

Array = NDArray[np.float64]
Index = NDArray[np.signedinteger]
Mask = NDArray[np.bool_]

_CHUNK = 20_000  # rows worked out at a time, which bounds the memory
LEAST_PERIODS = 5  # in a fit: fewer amplify the encoder's quanta too much
_GAP = 3.0  # periods without a sample are a gap; no motion is known next to it
_SPEED = 1


def median_period(time: Array) -> float:
    """Usual time between two samples [s]."""
    return float(np.median(np.diff(time))) if len(time) > 1 else float("inf")


def wheel_motion(
    time: Array, position: Array, velocity: Array, at: Array, span: float
) -> WheelMotion:
    """Speed [rad/s] and acceleration [rad/s^2] of the wheels at some times, each (m, 3).

    A motion of constant acceleration is fitted to the samples within span / 2 [s] either side
    (least squares): to positions [rad], or to velocities [rad/s] where a wheel has no positions.
    NaN next to gaps, before the first and after the last sample.

    Args:
        time: of the samples [s], rising, (n,).
        position: (n, 3), NaN where unknown.
        velocity: (n, 3), NaN where unknown.
        at: times asked for [s], (m,).
        span: of the fit [s]; widened to five encoder periods at least.
    """
    half = 0.5 * max(span, LEAST_PERIODS * median_period(time))
    speed, acceleration = np.full((len(at), 3), np.nan), np.full((len(at), 3), np.nan)
    for wheel in range(3):
        known = ~np.isnan(position[:, wheel])
        values, degree, derivative = position[:, wheel], 2, _SPEED
        if not known.any():
            known = ~np.isnan(velocity[:, wheel])
            values, degree, derivative = velocity[:, wheel], 1, 0
        if np.count_nonzero(known) <= degree:
            continue
        for rows in np.array_split(np.arange(len(at)), len(at) // _CHUNK + 1):
            shape = _local(time[known], values[known], at[rows], half, degree)
            speed[rows, wheel] = shape[:, derivative]
            # The second derivative of c x^2 is 2 c, the first of c x is c.
            acceleration[rows, wheel] = degree * shape[:, derivative + 1]
    return WheelMotion(speed, acceleration)


def _local(time: Array, values: Array, at: Array, half: float, degree: int) -> Array:
    """Coefficients of the local polynomials, lowest power first, (m, degree + 1)."""
    low = np.searchsorted(time, at - half)
    high = np.searchsorted(time, at + half, side="right")
    width = int((high - low).max(initial=0))
    exponents = np.arange(degree + 1)
    if width <= degree:
        return np.full((len(at), degree + 1), np.nan)
    index = low[:, None] + np.arange(width)
    inside = index < high[:, None]
    index = np.minimum(index, len(time) - 1)
    ago = np.where(inside, (time[index] - at[:, None]) / half, 0.0)
    start = values[np.minimum(low, len(time) - 1)]
    level = np.where(inside, values[index] - (start[:, None] if degree > 1 else 0.0), 0.0)
    powers = np.where(inside[:, :, None], ago[:, :, None] ** exponents, 0.0)
    normal = powers.transpose(0, 2, 1) @ powers
    right = powers.transpose(0, 2, 1) @ level[:, :, None]
    usable = _usable(time, at, low, high, half, degree)
    shape = np.full((len(at), degree + 1), np.nan)
    if usable.any():
        shape[usable] = np.linalg.solve(normal[usable], right[usable])[:, :, 0]
    return np.asarray(shape / half**exponents)


def _usable(time: Array, at: Array, low: Index, high: Index, half: float, degree: int) -> Mask:
    """Whether there are enough samples around a time, on both sides of it and without a gap."""
    period = median_period(time)
    last = len(time) - 1
    first_in, last_in = np.minimum(low, last), np.clip(high - 1, 0, last)
    enough = high - low > degree + 1
    around = (time[first_in] <= at) & (at <= time[last_in])
    # Number of gaps before each sample: none may lie inside the window.
    gaps = np.concatenate([[0], np.cumsum(np.diff(time) > _GAP * period)])
    whole = gaps[first_in] == gaps[last_in]
    # A window cut short at one side extrapolates; a third of its half is what it may miss.
    covered = (time[first_in] < at - half / 3.0) & (time[last_in] > at + half / 3.0)
    return np.asarray(enough & around & whole & covered)


def measured_speed(drive: Drive) -> Array:
    """Wheel speeds at the encoder's samples [rad/s], as published or from differences, (n, 3)."""
    step = np.diff(drive.encoder_time, prepend=drive.encoder_time[0] - 1.0)[:, None]
    differences = np.diff(drive.position, axis=0, prepend=drive.position[:1]) / step
    return np.where(np.isnan(drive.velocity), differences, drive.velocity)


def turned_angle(drive: Drive, wheel: int) -> Array:
    """Angle of a wheel at the encoder samples [rad]; integrated speed where none is published."""
    angle = drive.position[:, wheel]
    known = np.isfinite(angle)
    if known.all():
        return angle
    time = drive.encoder_time
    if known.any():
        return np.interp(time, time[known], angle[known])
    step = np.diff(time, prepend=time[0])
    return np.asarray(np.cumsum(np.nan_to_num(drive.velocity[:, wheel]) * step))
