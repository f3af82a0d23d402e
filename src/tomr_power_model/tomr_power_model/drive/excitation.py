"""Whether recordings hold enough motion, and varied motion, to determine anything."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.motion import measured_speed
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_MOVING = 0.3  # rad/s of a wheel
_LEAST_MOTION = 10.0  # s of all recordings together
_LEAST_WHEEL = 3.0  # s
_SAME = 0.15  # of the fastest wheel's speed
_VARIED = 0.05  # of the motion that must be at other speeds than the usual one


def check_excitation(drives: Sequence[Drive], robot: Robot) -> None:
    """Raise InputError where all recordings together hold too little motion, or one motion only."""
    names = ", ".join(item.name for item in drives)
    speeds = [measured_speed(item) for item in drives]
    _refuse_little(names, drives, speeds, robot)
    _refuse_uniform(names, np.concatenate(speeds))


def _refuse_little(
    names: str, drives: Sequence[Drive], speeds: Sequence[Array], robot: Robot
) -> None:
    moving = np.zeros(WHEELS)
    anything = 0.0
    for item, speed in zip(drives, speeds, strict=True):
        turning = np.abs(speed) > _MOVING
        step = np.minimum(np.diff(item.encoder_time, prepend=item.encoder_time[0]), 0.5)
        moving += (turning * step[:, None]).sum(axis=0)
        anything += float(step[turning.any(axis=1)].sum())
    if anything < _LEAST_MOTION:
        raise InputError(
            f"{names}: the wheels turn for {anything:.1f} s in all: drive at least "
            f"{_LEAST_MOTION:g} s, several headings and speeds, with starts and stops"
        )
    wheel = int(np.argmin(moving))
    if moving[wheel] < _LEAST_WHEEL:
        raise InputError(
            f"{names}: {robot.wheel_names[wheel]} turns for {moving[wheel]:.1f} s in all: add a "
            f"drive in which it turns for {_LEAST_WHEEL:g} s, e.g. a spin on the spot"
        )


def _refuse_uniform(names: str, speeds: Array) -> None:
    """At one speed and heading every friction is a constant: none can be distinguished from
    another, nor from a motor's values."""
    moving = speeds[np.isfinite(speeds).all(axis=1) & (np.abs(speeds) > _MOVING).any(axis=1)]
    if not len(moving):
        return  # no sample has all wheels: nothing can be decided
    usual = np.median(moving, axis=0)
    off = np.abs(moving - usual).max(axis=1) > _SAME * np.abs(usual).max()
    if np.mean(off) < _VARIED:
        usual_text = ", ".join(f"{value:.1f}" for value in usual)
        raise InputError(
            f"{names}: the wheels turn at one speed ({usual_text} rad/s) for "
            f"{100.0 * (1.0 - np.mean(off)):.0f} % of the motion, which distinguishes no effect "
            "from another: add drives at other speeds and headings, with starts and stops"
        )
