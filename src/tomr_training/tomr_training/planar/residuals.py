"""The ten residuals of a whole drive at once: the numbers of the model and residual stages.

The stages go message by message, this takes all samples together; test holds the two against each
other.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import RESIDUALS
from tomr_fault_diag.residuals.settings import BandSettings, ResidualSettings
from tomr_fault_diag.residuals.widths import widths
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.encoder_path import Rests, alike, at_rest, beside
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import WHEELS
from tomr_training.drives import Drive
from tomr_training.labels import LATELY
from tomr_training.planar.believed import Expected, run_believed
from tomr_training.planar.fits import Fits
from tomr_training.planar.schedule import TICK, tick_count
from tomr_training.planar.sensors import Signals

Array = NDArray[np.float64]

_SPEEDS = slice(4, 7)
_WINDOW = ResidualSettings().encoder_window / NANOSECONDS  # s


@frozen
class Compared:
    """What is compared in each tick; arrays (ticks, 10)."""

    modelled: Array  # as in a frame: total, motors, speeds, motors from encoders; 10 channels
    measured: Array  # the same
    voltage: Array  # of the drivers as simulated [V], (ticks, 3)
    held: Array  # and as their law has it on the measured speeds

    def residuals(self, bands: BandSettings) -> tuple[Array, Array]:
        """Residuals and bands, (ticks, 10), as `ResidualStage` gives them."""
        residual = self.measured - self.modelled
        residual[:, _SPEEDS] *= np.where(self.modelled[:, _SPEEDS] < 0.0, -1.0, 1.0)
        rows = [bands.of_residual(place, "W") for place in range(RESIDUALS)]
        return residual, widths(self.modelled, rows, LATELY)


def compare(drive: Drive, signals: Signals) -> Compared:
    """Modelled and measured values of every tick of a drive."""
    ticks, auxiliary = tick_count(drive), drive.believed.supply.auxiliary_power
    window = drive.believed.sensors.power_window
    centre = _tick_means(signals.power_time, signals.power_time[:, None], ticks)[:, 0]
    ends = TICK * np.arange(1, ticks + 1)
    offset = centre - 0.5 * window - (ends - 0.5 * TICK)  # of what is measured [s]
    believed = run_believed(drive, signals, 0.5 + offset / TICK)
    expected = believed.motion
    shown, _ = expected.monitored(signals.power_time, window)
    commanded = _tick_means(signals.power_time, shown, ticks)
    total = commanded.sum(axis=1, keepdims=True) + auxiliary
    _, speed, _ = Fits.over(signals.encoder_time, ticks, _WINDOW).all(signals.position)
    drawn = _tick_means(signals.power_time, signals.voltage * signals.drawn, ticks)
    derived = _derived(believed, EncoderFlaws.of(drive.believed), commanded, offset)
    return Compared(
        np.hstack([total, commanded, expected.tick_means(expected.steps.shown), derived]),
        np.hstack([drawn[:, 3:], drawn[:, :3], speed, drawn[:, :3]]),
        believed.simulated_held,
        believed.by_law,
    )


def _derived(believed: Expected, flaws: EncoderFlaws, commanded: Array, offset: Array) -> Array:
    """Power of each driver by the encoders [W], (ticks, 3): `PowerPredictor`'s encoder path."""
    wheels, of_path = flaws.turned(believed.measured), flaws.turned(believed.simulated)
    speed, measured, simulated = wheels.speed, wheels.acceleration, of_path.speed
    resting = at_rest(speed), at_rest(simulated)
    expected = alike(measured, of_path.acceleration, resting)
    inverse, held = _inverse(believed, (speed, measured, believed.held), offset)
    of_simulated, also = _inverse(
        believed, (alike(speed, simulated, resting), expected, believed.simulated_held), offset
    )
    return beside(commanded, inverse, of_simulated, Rests(*resting, held & also))


def _inverse(
    believed: Expected, moves: tuple[Array, Array, Array], offset: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Power of each driver by inverse dynamics [W], (ticks, 3), where wheels move with some speed
    and acceleration, their drivers at some voltages, (ticks, 3) each; and whether friction can hold
    a wheel at rest against them."""
    speed, acceleration, held = moves
    motion = np.zeros((len(speed), at.MOTION_HEADER + WHEELS * at.MOTION_WHEEL))
    motion[:, [at.MOTION_YAW, at.MOTION_HEADING]] = math.nan
    first = at.MOTION_HEADER + at.MOTION_WHEEL * np.arange(WHEELS)
    motion[:, first + at.MOTION_SPEED] = speed + offset[:, None] * acceleration
    motion[:, first + at.MOTION_ACCELERATION] = acceleration
    motion[:, first + at.MOTION_ANGLE] = math.nan
    motion[:, first + at.MOTION_VOLTAGE] = held
    found = np.empty((len(speed), WHEELS * at.POWER_WHEEL))
    compiled().drive_powers(believed.motion.variant.numbers, motion, found, WHEELS)
    obeyed = found[:, at.POWER_OBEYED :: at.POWER_WHEEL] > 0.0
    return found[:, at.POWER_DRAWN :: at.POWER_WHEEL], obeyed


def _tick_means(time: Array, values: Array, ticks: int) -> Array:
    """Means in each tick of values at some times, (ticks, c)."""
    tick = np.ceil(time / TICK - 1e-6).astype(np.int64)
    tick = np.clip(tick, 0, ticks + 1)  # those of time 0 and after the end go to the borders
    count = np.bincount(tick, minlength=ticks + 2)[1:-1]
    sums = [np.bincount(tick, row, ticks + 2)[1:-1] for row in values.T]
    return np.asarray(np.stack(sums, axis=1) / np.maximum(count, 1)[:, None])
