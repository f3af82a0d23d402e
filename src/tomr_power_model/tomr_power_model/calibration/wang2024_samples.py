"""Samples for a fit out of recordings, tick by tick as the model stage sees them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.errors import InputError
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow
from tomr_power_model.model.ticks import TickSettings, to_ns
from tomr_power_model.robot import Robot
from tomr_power_model.wang2024.fit import Samples

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

_STALE = to_ns(0.5)


def read_samples(path: Path, robot: Robot, namespace: str | None = None) -> Samples:
    """Those of a recording, as `tick_samples` has them."""
    return tick_samples(read_drive(path, robot, namespace), robot)


def joined(parts: Sequence[Samples]) -> Samples:
    """All that is known of some recordings, one after the other."""
    parts = [part.known() for part in parts]
    totals = [part.total for part in parts if part.total is not None]
    return Samples(
        WheelMotion(
            np.concatenate([part.motion.speed for part in parts]),
            np.concatenate([part.motion.acceleration for part in parts]),
        ),
        np.concatenate([part.power for part in parts]),
        np.concatenate(totals) if len(totals) == len(parts) else None,
    )


def tick_samples(
    drive: Drive,
    robot: Robot,
    encoder_window: int = to_ns(0.07),
    period: int = TickSettings().period,
) -> Samples:
    """Wheel motion from the encoders and measured power, one row per tick; NaN where missing.

    Times in nanoseconds. Raises InputError where the robot has no power of every motor.
    """
    if robot.measurement.source != "battery_state" or robot.measurement.quantity != "power":
        raise InputError(
            f"{drive.name}: a fit of wang2024 needs the power of each motor: robot.yaml has "
            f"measurement.source = {robot.measurement.source}, "
            f"measurement.quantity = {robot.measurement.quantity}"
        )
    stamps = _stamps(drive, drive.encoder_time)
    ticks = range((int(stamps[0]) // period + 1) * period, int(stamps[-1]) + 1, period)
    power_stamps = _stamps(drive, drive.power_time)
    return Samples(
        _motion(drive, stamps, ticks, EncoderWindow(encoder_window, period, _STALE)),
        np.stack([_means(power_stamps, own, ticks) for own in drive.power.T], axis=1),
        _means(_stamps(drive, drive.total_time), drive.total, ticks) if len(drive.total) else None,
    )


def _stamps(drive: Drive, time: Array) -> Stamps:
    """Times of a recording as stamps [ns]."""
    return drive.start_ns + np.round(1e9 * time).astype(np.int64)


def _motion(drive: Drive, stamps: Stamps, ticks: range, window: EncoderWindow) -> WheelMotion:
    """Speed and acceleration in the middle of the window that ends at each tick."""
    rows = zip(stamps.tolist(), drive.position.tolist(), drive.velocity.tolist(), strict=True)
    samples = (EncoderSample(stamp, tuple(angle), tuple(speed)) for stamp, angle, speed in rows)
    following = next(samples, None)
    speed, acceleration = np.full((len(ticks), 3), np.nan), np.full((len(ticks), 3), np.nan)
    for row, tick in enumerate(ticks):
        while following is not None and following.stamp_ns <= tick:
            window.add(following)
            following = next(samples, None)
        estimate = window.at(tick)
        speed[row], acceleration[row] = estimate.speed, estimate.acceleration
    return WheelMotion(speed, acceleration)


def _means(stamps: Stamps, power: Array, ticks: range) -> Array:
    """Mean power in (tick - period, tick], NaN where there is none."""
    known = np.isfinite(power)
    window = -(-(stamps[known] - ticks.start) // ticks.step)  # of the first tick not before it
    inside = (window >= 0) & (window < len(ticks))
    count = np.bincount(window[inside], minlength=len(ticks))
    total = np.bincount(window[inside], weights=power[known][inside], minlength=len(ticks))
    with np.errstate(invalid="ignore"):
        return np.asarray(total / count)
