"""What the sensors tell of a planar drive: encoder and power samples with quanta, noise, jitter.

As the simulator's: encoders at 100 Hz, power at 50 Hz as the mean of the 5 ms before the stamp.
"""

from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen

from tomr_fault_diag.training.drives import Drive
from tomr_fault_diag.training.planar.fleet import RATE, Array, Fleet
from tomr_fault_diag.training.planar.plant import Motion

ENCODER_RATE = 100.0  # Hz
POWER_RATE = 50.0  # Hz
_TOTAL_NOISE = 2.0  # the battery's monitor is that much noisier than a driver's
_RESOLUTION = 1.25e-3  # A and V
# Of the motors' power: the rollers of real wheels hand over to each other, a smooth disc does not.
_RIPPLE = 0.03


@frozen
class Signals:
    """Samples of a batch of drives: times [s] of shape (k, n), values (k, channels, n)."""

    encoder_time: Array
    position: Array  # rad, 3 channels
    power_time: Array
    voltage: Array  # V, 4 channels: motors 1-3, battery
    drawn: Array  # A, likewise

    @classmethod
    def of(cls, fleet: Fleet, drives: Sequence[Drive], motion: Motion) -> Self:
        """Sample a motion; the noise of a drive depends on its seed alone."""
        random = [np.random.default_rng([drive.seed, 1]) for drive in drives]
        jitter = [drive.mission.stamp_jitter for drive in drives]
        seconds = len(motion.power) / RATE
        encoder_time = _stamps(ENCODER_RATE, seconds, jitter, random)
        power_time = _stamps(POWER_RATE, seconds, jitter, random)
        angle = _at(motion.encoder, encoder_time)
        quantum = fleet.encoder_resolution
        voltage, drawn = _power(fleet, motion, power_time, random)
        return cls(encoder_time, np.round(angle / quantum) * quantum, power_time, voltage, drawn)


def _stamps(
    rate: float, seconds: float, jitter: Sequence[float], random: Sequence[np.random.Generator]
) -> Array:
    count = round(seconds * rate) + 1
    most = 0.4 / rate
    grid = np.arange(count) / rate
    moved = [
        grid + np.clip(generator.normal(0.0, 1.0, count) * spread, -most, most) * (grid > 0.0)
        for generator, spread in zip(random, jitter, strict=True)
    ]
    return np.clip(np.stack(moved, axis=1), 0.0, seconds)


def _at(values: Array, time: Array) -> Array:
    """Values at the ends of the steps, (m + 1, c, n), read at times (k, n), linear between."""
    place = time * RATE
    low = np.minimum(place.astype(np.int64), len(values) - 2)
    share = (place - low)[:, None, :]
    index = low[:, None, :]
    before = np.take_along_axis(values, index, axis=0)
    after = np.take_along_axis(values, index + 1, axis=0)
    return np.asarray(before + share * (after - before))


def _power(
    fleet: Fleet, motion: Motion, time: Array, random: Sequence[np.random.Generator]
) -> tuple[Array, Array]:
    ripple = 1.0 + _RIPPLE * np.stack(
        [generator.standard_normal((len(time), 3)) for generator in random], axis=-1
    )
    # The mean of the step before a stamp, as between two readings of an integral.
    energy = np.zeros((len(motion.power) + 1, 3, len(fleet)))
    np.cumsum(motion.power / RATE, axis=0, out=energy[1:])
    mean = (_at(energy, time) - _at(energy, np.maximum(time - 1.0 / RATE, 0.0))) * RATE
    mean = np.where(time[:, None, :] > 0.0, mean, fleet.standby)
    mean = (mean - fleet.standby) * ripple + fleet.standby
    power = np.concatenate([mean, mean.sum(axis=1, keepdims=True) + fleet.auxiliary], axis=1)
    scale = np.array([1.0, 1.0, 1.0, _TOTAL_NOISE])[:, None]
    noise = np.stack([generator.standard_normal((2, *power.shape[:2])) for generator in random], -1)
    voltage = fleet.voltage + scale * fleet.voltage_noise * noise[0]
    drawn = power / fleet.voltage + scale * fleet.current_noise * noise[1]
    return _rounded(voltage), _rounded(drawn)


def _rounded(values: Array) -> Array:
    return np.asarray(np.round(values / _RESOLUTION) * _RESOLUTION)
