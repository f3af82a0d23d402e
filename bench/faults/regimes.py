"""What each wheel was doing in each tick, and power averaged over ticks."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

AT_REST = "at rest"

_MOVING = 0.1  # rad/s
_VARYING = 2.0  # rad/s^2: faster changes of the speed count as acceleration
_PAUSE = 0.3  # s: a wheel that stands for longer between two directions has stopped
_NEAR = 0.25  # s, before and after the change of sign
_AFTER_STOP = 1.0  # s
_BUMP_NS = (-100_000_000, 2_000_000_000)  # from before a bump to when it is over
_JUMP = 6.0  # times the median step between neighbours: no noise


def regimes_of(speed: Array, period: float) -> dict[str, Mask]:
    """Masks over ticks and wheels, (n, 3) each; every tick of a wheel is in exactly one.

    Args:
        speed: of the wheels, means over ticks [rad/s], (n, 3).
        period: of the ticks [s].
    """
    moving = np.abs(speed) > _MOVING
    varying = np.abs(np.gradient(speed, period, axis=0)) > _VARYING
    reversing = np.stack([_reversing(wheel, period) for wheel in speed.T], axis=1)
    stopped = np.stack([_stopped(wheel, period) for wheel in moving.T], axis=1)
    calm = ~reversing
    return {
        AT_REST: calm & ~moving & ~stopped,
        "within 1 s after stops": calm & stopped,
        "in reversals": reversing,
        "steady": calm & moving & ~varying,
        "accelerating": calm & moving & varying,
    }


def _reversing(speed: Array, period: float) -> Mask:
    """Around a change of sign of one wheel's speed, (n,)."""
    sign = np.where(np.abs(speed) > _MOVING, np.sign(speed), 0.0)
    turning = np.flatnonzero(sign)
    found = np.zeros(len(speed), dtype=bool)
    near = round(_NEAR / period)
    for before, after in pairwise(turning):
        if sign[before] != sign[after] and (after - before - 1) * period <= _PAUSE:
            found[max(0, before - near + 1) : after + near] = True
    return found


def _stopped(moving: Mask, period: float) -> Mask:
    """Where a wheel stands and moved less than `_AFTER_STOP` ago, (n,)."""
    ticks = np.arange(len(moving))
    last = np.maximum.accumulate(np.where(moving, ticks, -1))
    return np.asarray(~moving & (last >= 0) & ((ticks - last) * period <= _AFTER_STOP + 1e-9))


def undisturbed(stamp_ns: NDArray[np.int64], bumps_ns: Sequence[int]) -> Mask:
    """Stamps that no bump precedes closely, (n,): no model knows of a push."""
    since = stamp_ns[:, None] - np.array(bumps_ns, dtype=np.int64)
    return np.asarray(~((since > _BUMP_NS[0]) & (since < _BUMP_NS[1])).any(axis=1))


def tick_speeds(
    time_ns: NDArray[np.int64], angle: Array, stamp_ns: NDArray[np.int64], period_ns: int
) -> Array:
    """Mean speeds [rad/s] over the ticks that end at the stamps, (n, 3), from angles (m, 3) [rad].

    NaN where the encoders show nothing of a tick's start or end.
    """
    ends = (stamp_ns - time_ns[0]).astype(np.float64)
    time = (time_ns - time_ns[0]).astype(np.float64)
    columns = []
    for wheel in angle.T:
        known = np.isfinite(wheel)

        def at(moment: Array, known: Mask = known, wheel: Array = wheel) -> Array:
            return np.interp(moment, time[known], wheel[known], left=np.nan, right=np.nan)

        columns.append((at(ends) - at(ends - period_ns)) / (1e-9 * period_ns))
    return np.stack(columns, axis=1)


def tick_means(
    time_ns: NDArray[np.int64], value: Array, stamp_ns: NDArray[np.int64], period_ns: int
) -> Array:
    """Means of samples over (stamp - period, stamp] of each tick, (n,); NaN without a sample."""
    tick = np.searchsorted(stamp_ns, time_ns, side="left")
    inside = np.flatnonzero(tick < len(stamp_ns))
    inside = inside[stamp_ns[tick[inside]] - time_ns[inside] < period_ns]
    count = np.bincount(tick[inside], minlength=len(stamp_ns))
    total = np.bincount(tick[inside], value[inside], minlength=len(stamp_ns))
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def rms(values: Array) -> float:
    """Root of the mean square of what is known; NaN of nothing."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def noise_of(values: Array) -> float:
    """Standard deviation of noise from one value to the next, (n,), without jumps."""
    steps = np.abs(np.diff(values))
    usual = steps[steps <= _JUMP * np.median(steps)] if len(steps) else steps
    return rms(usual) / math.sqrt(2.0)
