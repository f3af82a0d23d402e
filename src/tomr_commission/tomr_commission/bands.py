"""Bands of one robot: how its residuals scatter in healthy driving, and in which regime."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from attrs import asdict, evolve, frozen
from numpy.typing import NDArray

from tomr_commission.observed import (
    Observed,
    along_bands_of,
    band_of,
    reports_currents,
    voltage_bands_of,
    yaw_band_of,
)
from tomr_commission.request import BandChoice
from tomr_fault_diag.residuals.calibrated import fit_band, fit_bands, widened
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.widths import moved
from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_REST = 0.1  # rad/s: a slower wheel stands
_STEADY = 0.3  # rad/s over three ticks
_LATELY = 10  # ticks
_FEW = 3  # residuals
_LEAST_STEADY = 40  # ticks, from which a torque is estimated
KINDS: Mapping[str, Sequence[int]] = {
    "total power": [TOTAL],
    "motor power, command path": list(MOTORS),
    "motor power, encoder path": list(ENCODERS),
    "wheel speed": list(SPEEDS),
}


def bands_of(drives: Sequence[Observed], choice: BandChoice) -> BandSettings:
    """Bands that the healthy residuals of drives stay within, with a margin.

    Raises InputError where they are too few to estimate them.
    """
    fitted = fit_bands(
        np.concatenate([drive.residual for drive in drives]),
        np.concatenate([drive.modelled for drive in drives]),
        np.concatenate([drive.change for drive in drives]),
        str(drives[0].units[MOTORS.start]),
        choice.within,
    )
    wide = _inertial_widened(drives, widened(fitted, choice.margin, choice.speed_factor), choice)
    wide = _with_voltages(drives, wide, choice)
    return BandSettings(**{name: float(f"{value:.4g}") for name, value in asdict(wide).items()})


def _inertial_widened(
    drives: Sequence[Observed], bands: BandSettings, choice: BandChoice
) -> BandSettings:
    """Bands in which the healthy residuals of an IMU stay: as they are, or wider."""

    def wider(ratios: Sequence[Array]) -> float:
        ratio = np.concatenate([ratio.ravel() for ratio in ratios])
        known = ratio[np.isfinite(ratio)]
        if not len(known):
            return 1.0
        return max(choice.margin * float(np.quantile(known, choice.within)), 1.0)

    yaw = wider([np.abs(drive.yaw[:, 0]) / yaw_band_of(drive, bands) for drive in drives])
    along = wider([np.abs(drive.along[:, :2]) / along_bands_of(drive, bands) for drive in drives])
    return evolve(
        bands,
        yaw=yaw * bands.yaw,
        yaw_relative=yaw * bands.yaw_relative,
        along=along * bands.along,
        along_relative=along * bands.along_relative,
    )


def _with_voltages(
    drives: Sequence[Observed], bands: BandSettings, choice: BandChoice
) -> BandSettings:
    """Bands in which voltages of healthy drivers stay; as they are where these are not known."""
    volts = np.concatenate([drive.volts for drive in drives])
    change = np.concatenate([moved(drive.volts[:, WHEELS:], drive.lately) for drive in drives])
    band = fit_band(volts[:, :WHEELS], volts[:, WHEELS:], change, choice.within)
    if band is None:
        return bands
    return evolve(
        bands,
        voltage=choice.margin * band.least,
        voltage_relative=choice.margin * band.relative,
        voltage_transient=choice.margin * band.transient,
    )


def regimes(drive: Observed) -> Mapping[str, Mask]:
    """What each wheel does at each tick, (n, 3)."""
    speed = np.nan_to_num(drive.modelled[:, list(SPEEDS)])
    change = drive.change[:, list(SPEEDS)]
    way = np.sign(np.where(np.abs(speed) > _REST, speed, 0.0))
    highest, lowest = way.copy(), way.copy()
    for back in range(1, _LATELY):
        highest[back:] = np.maximum(highest[back:], way[:-back])
        lowest[back:] = np.minimum(lowest[back:], way[:-back])
    rest = (way == 0.0) & (highest == lowest)
    reversing = (highest > 0.0) & (lowest < 0.0)
    starting = ~rest & ~reversing & (highest != lowest)
    steady = ~rest & ~reversing & ~starting & (change < _STEADY)
    return {
        "at rest": rest,
        "starts and stops": starting,
        "reversals": reversing,
        "steady": steady,
        "other changes of speed": ~(rest | reversing | starting | steady),
    }


@frozen
class RegimeLine:
    """How one kind of residual scatters in one regime."""

    regime: str
    kind: str
    unit: str
    count: int
    rms: float  # in the unit
    high: float  # 99.9 % of |residual|, in the unit
    outside: float  # share outside of the band


def regime_table(drives: Sequence[Observed], bands: BandSettings) -> list[RegimeLine]:
    """Residuals of drives by regime and kind."""
    masks = [regimes(drive) for drive in drives]
    parts = [[*_by_kind(drive, bands)] for drive in drives]
    lines = []
    for regime in masks[0]:
        for same in zip(*parts, strict=True):
            sizes, ratios = [], []
            for mask, one in zip(masks, same, strict=True):
                is_of_wheels = one.residual.shape[1] > 1
                rows = mask[regime] if is_of_wheels else _any_or_all(mask, regime)
                known = rows & np.isfinite(one.residual)
                size = np.abs(one.residual)[known]
                sizes.append(size)
                ratios.append(size / one.band[known])
            size, ratio = np.concatenate(sizes), np.concatenate(ratios)
            if len(size):
                rms, high = float(np.sqrt(np.mean(size**2))), float(np.quantile(size, 0.999))
                share = float(np.mean(ratio > 1.0))
                kind, unit = same[0].kind, same[0].unit
                lines.append(RegimeLine(regime, kind, unit, len(size), rms, high, share))
    return lines


@frozen
class _Part:
    """Residuals of one kind in a drive, and half widths of their bands, (n, k) each."""

    kind: str
    unit: str
    residual: Array
    band: Array


def _by_kind(drive: Observed, bands: BandSettings) -> Iterator[_Part]:
    """The residuals that bands are fitted to, and those of the drivers' voltages."""
    widths = band_of(drive, bands)
    for kind, channels in KINDS.items():
        unit = str(drive.units[channels[0]])
        yield _Part(kind, unit, drive.residual[:, channels], widths[:, channels])
    volts = drive.volts[:, :WHEELS]
    yield _Part("driver's voltage", "V", volts, voltage_bands_of(drive, bands))


def _any_or_all(mask: Mapping[str, Mask], regime: str) -> Mask:
    """Of the whole robot: it rests or is steady where all wheels are, else where any wheel is."""
    quiet = regime in ("at rest", "steady")
    return np.asarray(mask[regime].all(axis=1) if quiet else mask[regime].any(axis=1))[:, None]


def outside(drives: Sequence[Observed], bands: BandSettings) -> dict[str, float]:
    """Share of the drives' residuals outside of the bands, by kind."""
    ratio = np.concatenate([np.abs(drive.residual) / band_of(drive, bands) for drive in drives])
    shares = {}
    for kind, channels in KINDS.items():
        known = ratio[:, list(channels)][np.isfinite(ratio[:, list(channels)])]
        if len(known):
            shares[kind] = float(np.mean(known > 1.0))
    return shares


def needed(drive: Observed, bands: BandSettings, within: float) -> dict[str, float]:
    """How wide bands a drive's residuals ask for, in bands, by kind; one or two alone do not."""
    ratio = np.abs(drive.residual) / band_of(drive, bands)
    found = {}
    for kind, channels in KINDS.items():
        known = ratio[:, list(channels)][np.isfinite(ratio[:, list(channels)])]
        if len(known):
            found[kind] = float(np.quantile(known, min(within, max(1.0 - _FEW / len(known), 0.0))))
    return found


@frozen
class Drag:
    """Torque that wheels need in steady motion, as their power or current shows it."""

    added: Array  # beyond the modelled; N m, or A where currents are compared; (3,)
    usual: Array  # as modelled, the same


def steady_drag(drive: Observed) -> Drag:
    """What the residuals of power amount to as a torque that resists each wheel.

    NaN for a wheel that is hardly ever steady.
    """
    speed = np.abs(np.nan_to_num(drive.modelled[:, list(SPEEDS)]))
    residual, modelled = drive.residual[:, list(MOTORS)], drive.modelled[:, list(MOTORS)]
    rows = regimes(drive)["steady"] & np.isfinite(residual) & np.isfinite(modelled)
    weight = np.where(rows, speed, 0.0)
    # A current is a torque already, power one times the speed.
    per_torque = np.ones_like(weight) if reports_currents(drive) else weight
    total = np.where(rows.sum(axis=0) < _LEAST_STEADY, np.nan, (weight * per_torque).sum(axis=0))

    def torque(drawn: Array) -> Array:
        return np.asarray((weight * np.where(rows, drawn, 0.0)).sum(axis=0) / total)

    return Drag(torque(residual), np.abs(torque(modelled)))
