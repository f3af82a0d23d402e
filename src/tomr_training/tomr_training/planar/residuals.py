"""The ten residuals of a whole drive at once: the numbers of the model and residual stages.

The stages go message by message, this takes all samples together; test holds the two against each
other.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.settings import BandSettings, ResidualSettings
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled
from tomr_power_model.model.encoders import LONG_S
from tomr_power_model.model.resting import FADES, MOVING
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import WHEELS
from tomr_training.drives import Drive
from tomr_training.labels import spread
from tomr_training.planar.plant import Motion, at_times, run_believed
from tomr_training.planar.schedule import TICK
from tomr_training.planar.sensors import ENCODER_RATE, Signals

Array = NDArray[np.float64]

_WINDOW = ResidualSettings().encoder_window / NANOSECONDS  # s


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
    ticks, auxiliary = expected.ticks, drive.believed.supply.auxiliary_power
    shown, _ = expected.monitored(signals.power_time, drive.believed.sensors.power_window)
    commanded = _tick_means(signals.power_time, shown, ticks)
    total = commanded.sum(axis=1, keepdims=True) + auxiliary
    _, speed, _ = _fitted(signals.encoder_time, signals.position, ticks, _WINDOW)
    drawn = _tick_means(signals.power_time, signals.voltage * signals.drawn, ticks)
    derived = _derived(drive, expected, signals)
    return Compared(
        np.hstack([total, commanded, expected.tick_means(expected.steps.speed), derived]),
        np.hstack([drawn[:, 3:], drawn[:, :3], speed, drawn[:, :3]]),
    )


def _derived(drive: Drive, expected: Motion, signals: Signals) -> Array:
    """Power of each driver by the encoders [W], (ticks, 3): `PowerPredictor`'s encoder path."""
    angle, speed, acceleration = _beside(expected, signals)
    half = 0.5 * TICK
    middle = _tick_means(signals.power_time, signals.power_time[:, None], expected.ticks)[:, 0]
    ends = TICK * np.arange(1, expected.ticks + 1)
    offset = middle - 0.5 * drive.believed.sensors.power_window - (ends - half)
    at_end = angle + half * (speed + 0.5 * half * acceleration)
    held = _held(drive, expected, at_end, speed)
    earlier = np.vstack([held[:1], held[:-1]])
    held = earlier + (0.5 + offset / TICK)[:, None] * (held - earlier)
    motion = np.zeros((len(speed), at.MOTION_HEADER + WHEELS * at.MOTION_WHEEL))
    motion[:, [at.MOTION_YAW, at.MOTION_HEADING]] = math.nan
    first = at.MOTION_HEADER + at.MOTION_WHEEL * np.arange(WHEELS)
    motion[:, first + at.MOTION_SPEED] = speed + offset[:, None] * acceleration
    motion[:, first + at.MOTION_ACCELERATION] = acceleration
    motion[:, first + at.MOTION_ANGLE] = math.nan
    motion[:, first + at.MOTION_VOLTAGE] = held
    found = np.empty((len(speed), WHEELS * at.POWER_WHEEL))
    compiled().drive_powers(expected.variant.numbers, motion, found, WHEELS)
    return found[:, at.POWER_DRAWN :: at.POWER_WHEEL]


def _beside(expected: Motion, signals: Signals) -> tuple[Array, Array, Array]:
    """Angle, speed and acceleration at the ticks' middles, (ticks, 3): `EncoderWindow.beside`."""
    simulated = expected.reported
    edges = TICK * np.arange(expected.ticks + 1, dtype=np.float64)
    angles = at_times(simulated, expected.step, edges)
    middles = at_times(simulated, expected.step, edges[1:] - 0.5 * TICK)
    ends = np.round(edges / expected.step).astype(np.int64)
    # Speeds at the steps' ends from the means between them: it starts at rest.
    speeds = np.zeros_like(simulated)
    turns = np.where(np.arange(len(simulated) - 1) % 2 == 0, 1.0, -1.0)[:, None]
    speeds[1:] = 2.0 * turns * np.cumsum(turns * expected.steps.speed, axis=0)
    ahead = signals.position - at_times(simulated, expected.step, signals.encoder_time)
    offset, slope, curve = _fitted(signals.encoder_time, ahead, expected.ticks, LONG_S)
    change = np.diff(speeds[ends], axis=0) / TICK
    return middles + offset, np.diff(angles, axis=0) / TICK + slope, change + curve


def _held(drive: Drive, expected: Motion, angle: Array, speed: Array) -> Array:
    """Voltages that drivers hold at the ticks' ends [V], (ticks, 3): `RestingDrivers`."""
    last = np.round(TICK * np.arange(1, expected.ticks + 1) / expected.step).astype(np.int64)
    asked, sums = expected.steps.asked[last - 1], expected.steps.sums[last - 1]
    ahead = expected.reported[last] - angle
    moving = np.abs(speed) > MOVING
    offset, known = -ahead[0], np.empty_like(ahead)
    for k, row in enumerate(ahead):
        offset = offset - FADES * moving[k] * (row + offset)
        known[k] = row + offset
    controller = drive.believed.controller
    return np.asarray(
        controller.proportional * (asked - speed) + controller.integral * (sums + known)
    )


def _fitted(time: Array, values: Array, ticks: int, window: float) -> tuple[Array, Array, Array]:
    """Value, slope and curvature at the ticks' middles, (ticks, 3), of parabolas through samples.

    Args:
        time: of the encoder samples [s], (k,).
        values: of the wheels, (k, 3).
        ticks: how many.
        window: before a tick's end from which samples count [s].
    """
    per_tick = round(TICK * ENCODER_RATE)
    # A jittering sample may belong to the tick before.
    last = per_tick * np.arange(1, ticks + 1)[:, None] + 1
    wanted = last + np.arange(-round(window * ENCODER_RATE) - 2, 1)
    index = np.clip(wanted, 0, len(time) - 1)
    tick = TICK * np.arange(1, ticks + 1)[:, None]
    when = time[index]  # (ticks, candidates)
    inside = (wanted == index) & (when <= tick + 1e-9) & (when > tick - window + 1e-9)
    unit = 0.05
    s = np.where(inside, (when - tick + 0.5 * TICK) / unit, 0.0)
    origin = values[index[:, -1]]
    powers = [inside * s**k for k in range(5)]
    p0, p1, p2, p3, p4 = (power.sum(axis=1) for power in powers)
    moments = np.array([[p0, p1, p2], [p1, p2, p3], [p2, p3, p4]]).transpose(2, 0, 1)
    known = np.linalg.matrix_rank(moments) == 3
    shifted = values[index] - origin[:, None]
    right = np.stack([np.einsum("tc,tcw->tw", power, shifted) for power in powers[:3]], axis=1)
    found = np.full(right.shape, np.nan)
    found[known] = np.linalg.solve(moments[known], right[known])
    return origin + found[:, 0], found[:, 1] / unit, 2.0 * found[:, 2] / unit**2


def _tick_means(time: Array, values: Array, ticks: int) -> Array:
    """Means in each tick of values at some times, (ticks, c)."""
    tick = np.ceil(time / TICK - 1e-6).astype(np.int64)
    tick = np.clip(tick, 0, ticks + 1)  # those of time 0 and after the end go to the borders
    count = np.bincount(tick, minlength=ticks + 2)[1:-1]
    sums = [np.bincount(tick, row, ticks + 2)[1:-1] for row in values.T]
    return np.asarray(np.stack(sums, axis=1) / np.maximum(count, 1)[:, None])
