"""Healthy drives over ramps: slopes of up to five degrees, one after another."""

import math

import numpy as np
from attrs import evolve

from tomr_power_model.robot import GRAVITY
from tomr_training.drives import Bump, Drive

_STEEP = (1.0, 5.0)  # degrees
_RISE = (0.2, 1.0)  # s, in which a robot gets onto a ramp, or off it
_LONG = (1.0, 8.0)  # s on it
_BETWEEN = (1.0, 6.0)  # s
_STEP = 0.1  # s

Random = np.random.Generator


def over_ramps(drive: Drive) -> Drive:
    """A drive that meets ramps, beside the bumps it has."""
    random = np.random.default_rng([drive.seed, 11])
    found, time = list(drive.bumps), float(random.uniform(1.0, 4.0))
    while time < drive.length - 2.0:
        pieces = _ramp(time, drive.plant.mass, random)
        found += [piece for piece in pieces if piece.start < drive.length]
        time = pieces[-1].start + pieces[-1].duration + float(random.uniform(*_BETWEEN))
    return evolve(drive, bumps=tuple(sorted(found, key=lambda bump: bump.start)))


def _ramp(start: float, mass: float, random: Random) -> list[Bump]:
    """The pull of a ramp, in pieces."""
    pull = mass * GRAVITY * math.sin(math.radians(float(random.uniform(*_STEEP))))
    azimuth = float(random.uniform(-math.pi, math.pi))
    steps = max(int(float(random.uniform(*_RISE)) / _STEP), 1)
    long = max(int(float(random.uniform(*_LONG)) / _STEP), 1) * _STEP
    onto = [(start + k * _STEP, _STEP, (k + 0.5) / steps) for k in range(steps)]
    top = start + steps * _STEP
    off = [(top + long + k * _STEP, _STEP, 1.0 - (k + 0.5) / steps) for k in range(steps)]
    return [
        Bump(
            at,
            length,
            (share * pull * math.cos(azimuth), share * pull * math.sin(azimuth)),
            0.0,
            is_slope=True,
        )
        for at, length, share in (*onto, (top, long, 1.0), *off)
    ]
