"""The ten residuals of a whole drive at once: the numbers of the model and residual stages.

The stages go message by message, this takes all samples together; test holds the two against each
other.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled
from tomr_power_model.robot import WHEELS
from tomr_training.drives import Drive
from tomr_training.labels import spread
from tomr_training.planar.plant import Motion, run_believed
from tomr_training.planar.schedule import TICK
from tomr_training.planar.sensors import ENCODER_RATE, Signals

Array = NDArray[np.float64]

_WINDOW = 0.07  # s, of the fit to the encoders


@frozen
class Compared:
    """What is compared in each tick; arrays (ticks, 10)."""

    modelled: Array  # as in a frame: total, motors, speeds, motors from encoders; 10 channels
    measured: Array  # the same

    def residuals(self, bands: BandSettings) -> tuple[Array, Array]:
        """Residuals and bands, (ticks, 10), as `ResidualStage` gives them."""
        residual = self.measured - self.modelled
        speeds = slice(4, 7)
        residual[:, speeds] *= np.where(self.modelled[:, speeds] < 0.0, -1.0, 1.0)
        motors = [bands.power] * 3
        floor = np.array([bands.power * bands.total_factor, *motors, *[bands.speed] * 3, *motors])
        motors = [bands.relative] * 3
        relative = np.array([bands.total_relative, *motors, *[bands.speed_relative] * 3, *motors])
        band = np.maximum(floor, relative * np.abs(self.modelled))
        change = np.full(10, bands.transient)
        change[speeds] = bands.speed_transient
        return residual, band + change * spread(self.modelled)


def compare(drive: Drive, signals: Signals) -> Compared:
    """Modelled and measured values of every tick of a drive."""
    expected = run_believed(drive)
    commanded = expected.tick_means(expected.steps.power)
    speed, acceleration = _fitted(signals, expected.ticks)
    total = commanded.sum(axis=1, keepdims=True) + drive.believed.supply.auxiliary_power
    drawn = _averaged(signals, expected.ticks)
    derived = _derived(expected, speed, acceleration)
    return Compared(
        np.hstack([total, commanded, expected.tick_means(expected.steps.speed), derived]),
        np.hstack([drawn[:, 3:], drawn[:, :3], speed, drawn[:, :3]]),
    )


def _derived(expected: Motion, speed: Array, acceleration: Array) -> Array:
    """Power of each driver that the wheels' motion takes [W], (ticks, 3): inverse dynamics."""
    ticks = len(speed)
    motion = np.zeros((ticks, at.MOTION_HEADER + WHEELS * at.MOTION_WHEEL))
    motion[:, [at.MOTION_YAW, at.MOTION_HEADING]] = math.nan
    first = at.MOTION_HEADER + at.MOTION_WHEEL * np.arange(WHEELS)
    motion[:, first + at.MOTION_SPEED] = speed
    motion[:, first + at.MOTION_ACCELERATION] = acceleration
    motion[:, first + at.MOTION_ANGLE] = math.nan
    found = np.empty((ticks, WHEELS * at.POWER_WHEEL))
    compiled().drive_powers(expected.variant.numbers, motion, found, WHEELS)
    return found[:, at.POWER_DRAWN :: at.POWER_WHEEL]


def _fitted(signals: Signals, ticks: int) -> tuple[Array, Array]:
    """Speed and acceleration of the wheels by the fit of `model.encoders`, (ticks, 3)."""
    per_tick = round(TICK * ENCODER_RATE)
    # A jittering sample may belong to the tick before.
    last = per_tick * np.arange(1, ticks + 1)[:, None] + 1
    wanted = last + np.arange(-round(_WINDOW * ENCODER_RATE) - 2, 1)
    index = np.clip(wanted, 0, len(signals.encoder_time) - 1)
    tick = TICK * np.arange(1, ticks + 1)[:, None]
    time = signals.encoder_time[index]  # (ticks, candidates)
    inside = (wanted == index) & (time <= tick + 1e-9) & (time > tick - _WINDOW + 1e-9)
    unit = 0.05
    s = np.where(inside, (time - tick + 0.5 * TICK) / unit, 0.0)
    position = signals.position[index] - signals.position[index[:, :1]]
    weights = [inside * s**k for k in range(5)]
    p0, p1, p2, p3, p4 = (weight.sum(axis=1) for weight in weights)
    q = [np.einsum("tc,tcw->tw", weight, position) for weight in weights[:3]]
    # Cramer's rule for the normal equations; only slope and curvature are wanted.
    c00, c01, c02 = p2 * p4 - p3 * p3, p2 * p3 - p1 * p4, p1 * p3 - p2 * p2
    c11, c12, c22 = p0 * p4 - p2 * p2, p1 * p2 - p0 * p3, p0 * p2 - p1 * p1
    determinant = p0 * c00 + p1 * c01 + p2 * c02
    determinant = np.where(determinant == 0.0, np.nan, determinant)[:, None]
    slope = (c01[:, None] * q[0] + c11[:, None] * q[1] + c12[:, None] * q[2]) / determinant
    curve = (c02[:, None] * q[0] + c12[:, None] * q[1] + c22[:, None] * q[2]) / determinant
    return slope / unit, 2.0 * curve / unit**2


def _averaged(signals: Signals, ticks: int) -> Array:
    """Mean measured power in each tick [W], (ticks, 4)."""
    tick = np.ceil(signals.power_time / TICK - 1e-6).astype(np.int64)
    tick = np.clip(tick, 0, ticks + 1)  # those of time 0 and after the end go to the borders
    count = np.bincount(tick, minlength=ticks + 2)[1:-1]
    power = (signals.voltage * signals.drawn).T
    sums = [np.bincount(tick, row, ticks + 2)[1:-1] for row in power]
    return np.asarray(np.stack(sums, axis=1) / np.maximum(count, 1)[:, None])
