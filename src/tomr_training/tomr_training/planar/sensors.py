"""What the sensors show of a planar drive: encoder and power samples with quanta, noise, jitter.

As the simulator's: encoders at 100 Hz, power at 50 Hz as the mean of the 5 ms before the stamp.
"""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_training.drives import Drive, wheel_of
from tomr_training.planar.faults import READINGS
from tomr_training.planar.plant import Motion, at_times
from tomr_training.planar.schedule import TICK, end_of

Array = NDArray[np.float64]

ENCODER_RATE = 100.0  # Hz
POWER_RATE = 50.0  # Hz
BATTERY = 3  # channel of the whole robot, after those of the motors
_SPAN = 0.005  # s, that a power sample is the mean of
_TOTAL_NOISE = 2.0  # the battery's monitor is that much noisier than a driver's
_RESOLUTION = 1.25e-3  # A and V
# Of the motors' power: the rollers of real wheels hand over to each other, a smooth disc does not.
_RIPPLE = 0.03


@frozen
class Signals:
    """Samples of a drive: times [s], (k,), values (k, channels)."""

    encoder_time: Array
    position: Array  # rad, 3 channels
    power_time: Array
    voltage: Array  # V, 4 channels: motors 1-3, battery
    drawn: Array  # A, likewise

    @classmethod
    def of(cls, drive: Drive, motion: Motion) -> Self:
        """Sample a motion; the noise of a drive depends on its seed alone."""
        random = np.random.default_rng([drive.seed, 1])
        seconds, jitter = motion.ticks * TICK, drive.mission.stamp_jitter
        encoder_time = _stamps(ENCODER_RATE, seconds, jitter, random)
        power_time = _stamps(POWER_RATE, seconds, jitter, random)
        angle = at_times(motion.reported, motion.step, encoder_time)
        quantum = drive.plant.sensors.encoder_resolution
        position = np.round(angle / quantum) * quantum if quantum > 0.0 else angle
        voltage, drawn = _power(drive, motion, power_time, random)
        return cls(encoder_time, position, power_time, voltage, drawn)


def _stamps(rate: float, seconds: float, jitter: float, random: np.random.Generator) -> Array:
    count = round(seconds * rate) + 1
    most = 0.4 / rate
    grid = np.arange(count) / rate
    moved = np.clip(random.normal(0.0, 1.0, count) * jitter, -most, most) * (grid > 0.0)
    return np.clip(grid + moved, 0.0, seconds)


def _power(
    drive: Drive, motion: Motion, time: Array, random: np.random.Generator
) -> tuple[Array, Array]:
    robot = drive.plant
    ripple = 1.0 + _RIPPLE * random.standard_normal((len(time), 3))
    # The first sample comes before anything could be averaged: it shows the first span.
    mean, voltage = motion.monitored(np.maximum(time, _SPAN), _SPAN)
    standby = np.array(robot.everywhere("electrical.driver_standby", "power"))
    mean = (mean - standby) * ripple + standby
    total = mean.sum(axis=1, keepdims=True) + robot.supply.auxiliary_power
    power = np.concatenate([mean, total], axis=1)
    scale = np.array([1.0, 1.0, 1.0, _TOTAL_NOISE])
    noise = random.standard_normal((2, *power.shape))
    seen = voltage[:, None] + scale * robot.sensors.voltage_noise * noise[0]
    drawn = power / voltage[:, None] + scale * robot.sensors.current_noise * noise[1]
    return _rounded(seen), _misread(drive, time, _rounded(seen), _rounded(drawn))


def _misread(drive: Drive, time: Array, voltage: Array, drawn: Array) -> Array:
    """Currents [A], (k, 4), as faulty sensors report them."""
    for fault in drive.mission.faults:
        if fault.fault_id in READINGS:
            wheel = wheel_of(fault)
            column = BATTERY if wheel is None else wheel
            when = (time >= fault.start) & (time < end_of(fault, drive))
            power = voltage[when, column] * drawn[when, column]
            wrong = READINGS[fault.fault_id](power, fault)
            drawn[when, column] = wrong / voltage[when, column]
    return drawn


def _rounded(values: Array) -> Array:
    return np.asarray(np.round(values / _RESOLUTION) * _RESOLUTION)
