"""Bands calibrated on healthy driving, in place of the paper's fixed 5 % (Wang 2024, Eqs 19-20).

A healthy residual grows with what it is compared to and with the change of that: a description is
some percent off, and friction, inertia and braking partly cancel in the power but not in its error.
The shape of the band is fitted to the size of the residuals, its width to a share of them.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray
from scipy.optimize import nnls

from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL
from tomr_fault_diag.residuals.settings import LEAST_BAND, LEAST_FACTOR, BandSettings
from tomr_fault_diag.residuals.widths import Band
from tomr_power_model.errors import InputError

Array = NDArray[np.float64]

WITHIN = 0.999  # of healthy residuals
MARGIN = 1.5  # on top, for what other days and floors bring
SPEED_FACTOR = 2.0  # margin of speeds over that: loops of real drivers are not known as well
_LEAST = 2000  # residuals to fit to


def fit_bands(
    residual: Array, modelled: Array, change: Array, unit: str = "W", within: float = WITHIN
) -> BandSettings:
    """Bands that healthy residuals stay within.

    Args:
        residual: of many ticks, (n, 10), NaN where unknown.
        modelled: what they were compared to, (n, 10).
        change: how far the modelled values moved lately (`widths.moved`), (n, 10).
        unit: of the motors' residuals, W or A.
        within: share of the ticks that stay within.

    Raises:
        InputError: too few residuals to estimate a band.
    """

    def band(channels: Sequence[int]) -> Band | None:
        chosen = list(channels)
        return fit_band(residual[:, chosen], modelled[:, chosen], change[:, chosen], within)

    motor, speed, total = band([*MOTORS, *ENCODERS]), band(SPEEDS), band([TOTAL])
    if motor is None and total is None:
        raise InputError("too few healthy residuals to calibrate bands: give a minute of driving")
    found = BandSettings()
    if speed is not None:
        found = evolve(
            found,
            speed=speed.least,
            speed_relative=speed.relative,
            speed_transient=speed.transient,
        )
    if motor is not None:
        found = evolve(found, relative=motor.relative, transient=motor.transient)
        found = evolve(found, **{"power" if unit == "W" else "current": motor.least})
    if total is not None:
        least = found.power if unit == "W" else found.current
        factor = max(total.least / least, LEAST_FACTOR)
        found = evolve(found, total_relative=total.relative, total_factor=factor)
    return found


def widened(
    bands: BandSettings, margin: float = MARGIN, speed_factor: float = SPEED_FACTOR
) -> BandSettings:
    """Bands with a margin, that of wheel speeds so many times as large."""
    speed = margin * speed_factor
    return evolve(
        bands,
        relative=margin * bands.relative,
        power=margin * bands.power,
        current=margin * bands.current,
        transient=margin * bands.transient,
        total_relative=margin * bands.total_relative,
        speed=speed * bands.speed,
        speed_relative=speed * bands.speed_relative,
        speed_transient=speed * bands.speed_transient,
    )


def fit_band(residual: Array, modelled: Array, change: Array, within: float) -> Band | None:
    """One band for some residuals, None where there are too few."""
    known = np.isfinite(residual) & np.isfinite(modelled) & np.isfinite(change)
    size, model, moved = np.abs(residual[known]), np.abs(modelled[known]), change[known]
    if len(size) < _LEAST:
        return None
    shape, _ = nnls(np.stack([np.ones(len(size)), model, moved], axis=1), size)
    # A residual is never exactly as modelled: half the mean of all is the least.
    least = max(float(shape[0]), 0.5 * float(size.mean()), LEAST_BAND)
    width = np.maximum(least, shape[1] * model) + shape[2] * moved
    factor = float(np.quantile(size / width, within))
    return Band(max(factor * least, LEAST_BAND), factor * float(shape[1]), factor * float(shape[2]))
