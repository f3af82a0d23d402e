"""A drive as the residual stage of the diagnosis sees it: tick by tick, in arrays.

Bands are no part of it: the model and the measurements are run through once, and frames with any
bands are made of them afterwards.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import (
    MOTORS,
    NO_ENCODERS,
    NO_IMU,
    NOT_MEASURED,
    RESIDUALS,
    UNITS,
    Residual,
    ResidualFrame,
    Unit,
    rounded,
)
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.widths import moved, transient_ticks, widths
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]


@frozen
class Observed:
    """One drive of n ticks."""

    name: str
    stamp_ns: NDArray[np.int64]  # (n,)
    residual: Array  # measured - modelled; speeds along the expected direction; (n, 10)
    modelled: Array  # (n, 10)
    missing: NDArray[np.str_]  # why a residual is unknown, empty where it is known, (n, 10)
    units: NDArray[np.str_]  # of the residuals, (10,)
    yaw: Array  # gyro less wheels, and yaw rate as the wheels show [rad/s], (n, 2)
    along: Array  # accelerometer less wheels along x and y, and as the wheels show [m/s^2], (n, 4)
    volts: Array  # what drivers hold less what is simulated, and what is [V], (n, 6)

    @classmethod
    def of(cls, name: str, frames: list[ResidualFrame]) -> Self:
        """From what the residual stage said."""
        rows = [frame.residuals for frame in frames]
        units = [
            next(
                (row[channel].unit for row in rows if not row[channel].stale), rows[0][channel].unit
            )
            for channel in range(RESIDUALS)
        ]
        return cls(
            name,
            np.array([frame.stamp_ns for frame in frames], dtype=np.int64),
            np.array([[item.residual for item in row] for row in rows]),
            np.array([[item.modelled for item in row] for row in rows]),
            np.array([[item.missing for item in row] for row in rows], dtype=np.str_),
            np.array(units),
            np.array([[frame.yaw.residual, frame.yaw.modelled] for frame in frames]),
            np.array(
                [
                    [*(one.residual for one in frame.along), *(one.modelled for one in frame.along)]
                    for frame in frames
                ]
            ),
            np.array(
                [
                    [*(v.residual for v in frame.voltages), *(v.modelled for v in frame.voltages)]
                    for frame in frames
                ]
            ),
        )

    @property
    def lately(self) -> int:
        """Ticks over which a band grows with the model's change, as in the residual stage."""
        steps = np.diff(self.stamp_ns)
        return transient_ticks(round(float(np.median(steps)))) if len(steps) else 1

    @property
    def change(self) -> Array:
        """How far each modelled value moved lately, (n, 10); 0 where it is not known."""
        return moved(self.modelled, self.lately)

    @property
    def hours(self) -> float:
        """That its ticks cover."""
        steps = np.diff(self.stamp_ns)
        return float(np.minimum(steps, NANOSECONDS).sum()) / NANOSECONDS / 3600.0

    @property
    def seconds(self) -> Array:
        """Of each tick since the first, (n,)."""
        return np.asarray((self.stamp_ns - self.stamp_ns[0]) / NANOSECONDS)

    @property
    def silent(self) -> tuple[int, ...]:
        """Residuals that are never known: what the robot does not report."""
        return tuple(np.flatnonzero(~np.isfinite(self.residual).any(axis=0)).tolist())

    def silenced(self, channels: Sequence[int]) -> "Observed":
        """The drive of a robot that does not report some residuals."""
        residual, missing = self.residual.copy(), self.missing.astype("<U32")
        residual[:, list(channels)] = np.nan
        missing[:, list(channels)] = NOT_MEASURED
        return evolve(self, residual=residual, missing=missing)

    def without_imu(self) -> "Observed":
        """The drive of a robot without an IMU."""
        return evolve(self, yaw=self.yaw * np.nan, along=self.along * np.nan)

    def without(self, spans: Sequence[tuple[float, float]]) -> "Observed":
        """The drive without some intervals [s]."""
        keep = np.ones(len(self.stamp_ns), dtype=bool)
        for start, end in spans:
            keep &= (self.seconds < start) | (self.seconds > end)
        return self._of(keep, self.name)

    def part(self, rows: slice, name: str) -> "Observed":
        """Some of its ticks under another name."""
        return self._of(rows, name)

    def _of(self, rows: slice | NDArray[np.bool_], name: str) -> "Observed":
        return Observed(
            name,
            self.stamp_ns[rows],
            self.residual[rows],
            self.modelled[rows],
            self.missing[rows],
            self.units,
            self.yaw[rows],
            self.along[rows],
            self.volts[rows],
        )


def observe(bag: Path, name: str, robot: Robot, settings: DiagnosisSettings) -> Observed:
    """Run a recording through the pipeline of the diagnosis.

    Raises InputError for a recording that nothing can be compared in.
    """
    pipeline = Pipeline(robot, settings)
    with open_recording(bag) as recording:
        frames = [frame for _, step in diagnose(recording, pipeline) for frame in step.frames]
    found = Observed.of(name, frames)
    return found.without_imu() if pipeline.imu_mistake else found


def unit_of_motors(drive: Observed) -> str:
    """In which motors are compared: W or A."""
    return str(drive.units[MOTORS.start])


def reports_currents(drive: Observed) -> bool:
    """Whether motors are compared by their currents."""
    return unit_of_motors(drive) == "A"


def band_of(observed: Observed, bands: BandSettings) -> Array:
    """Half widths of the bands, (n, 10): those of the residual stage."""
    rows = [bands.of_residual(place, UNITS[str(unit)]) for place, unit in enumerate(observed.units)]
    return widths(observed.modelled, rows, observed.lately)


def yaw_band_of(observed: Observed, bands: BandSettings) -> Array:
    """Half widths of the band of the yaw rate [rad/s], (n,)."""
    return widths(observed.yaw[:, 1:], [bands.of_yaw], observed.lately)[:, 0]


def along_bands_of(observed: Observed, bands: BandSettings) -> Array:
    """Half widths of the bands of the acceleration along x and y [m/s^2], (n, 2)."""
    return widths(observed.along[:, 2:], [bands.of_force] * 2, observed.lately)


def voltage_bands_of(observed: Observed, bands: BandSettings) -> Array:
    """Half widths of the bands of the drivers' voltages [V], (n, 3)."""
    return widths(observed.volts[:, WHEELS:], [bands.of_voltage] * WHEELS, observed.lately)


def frames_of(observed: Observed, bands: BandSettings) -> list[ResidualFrame]:
    """The frames that the residual stage publishes with some bands."""
    width = band_of(observed, bands)
    units = [UNITS[str(unit)] for unit in observed.units]
    rows = zip(
        observed.stamp_ns.tolist(),
        observed.residual.tolist(),
        width.tolist(),
        observed.modelled.tolist(),
        observed.missing.tolist(),
        zip(observed.yaw.tolist(), yaw_band_of(observed, bands).tolist(), strict=True),
        zip(observed.along.tolist(), along_bands_of(observed, bands).tolist(), strict=True),
        zip(observed.volts.tolist(), voltage_bands_of(observed, bands).tolist(), strict=True),
        strict=True,
    )
    return [
        ResidualFrame(
            stamp,
            tuple(
                Residual(residual, rounded(band), modelled, unit, missing)
                for residual, band, modelled, unit, missing in zip(
                    residuals, widths, models, units, absent, strict=True
                )
            ),
            yaw=_of_imu(yaw, band, wheels, "rad/s"),
            along=(
                _of_imu(x, x_band, x_wheels, "m/s^2"),
                _of_imu(y, y_band, y_wheels, "m/s^2"),
            ),
            voltages=_voltages(volts, volt_bands),
        )
        for (
            *(stamp, residuals, widths, models, absent),
            ((yaw, wheels), band),
            ((x, y, x_wheels, y_wheels), (x_band, y_band)),
            (volts, volt_bands),
        ) in rows
    ]


def _voltages(
    volts: Sequence[float], bands: Sequence[float]
) -> tuple[Residual, Residual, Residual]:
    first, second, third = (
        Residual(residual, rounded(band), model, "V", "" if residual == residual else NO_ENCODERS)
        for residual, model, band in zip(volts[:WHEELS], volts[WHEELS:], bands, strict=True)
    )
    return first, second, third


def _of_imu(residual: float, band: float, wheels: float, unit: Unit) -> Residual:
    missing = "" if residual == residual else NO_IMU
    return Residual(residual, rounded(band), wheels, unit, missing)
