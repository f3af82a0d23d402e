"""The paper's energy model fitted to recordings, and how well it explains them."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.scoring import COLUMNS
from tomr_power_model.calibration.tables import Line
from tomr_power_model.calibration.wang2024_samples import joined, tick_samples
from tomr_power_model.drive.record import Drive
from tomr_power_model.model.scores import accuracy
from tomr_power_model.model.ticks import NANOSECONDS, TickSettings, to_ns
from tomr_power_model.robot import Robot
from tomr_power_model.wang2024 import Coefficients, Wang2024Model
from tomr_power_model.wang2024.fit import Samples, fit_wang2024

Array = NDArray[np.float64]


@frozen
class Wang2024Fit:
    """Coefficients of Wang 2024, and the accuracy over the ticks of each recording."""

    coefficients: Coefficients
    fitted: tuple[Line, ...]
    held_out: tuple[Line, ...]


def calibrate_wang2024(
    robot: Robot, drives: Sequence[Drive], held_out: Sequence[Drive], span_s: float | None = None
) -> Wang2024Fit:
    """Fit Wang 2024, Eqs 1-17, to drives; `span_s`: of the fit to the encoders, if not the usual.

    Raises InputError for a robot without power of each motor, or too little motion.
    """

    def samples_of(drive: Drive) -> Samples:
        if span_s is None:
            return tick_samples(drive, robot)
        return tick_samples(drive, robot, to_ns(span_s))

    samples = [samples_of(drive) for drive in drives]
    coefficients = fit_wang2024(robot, joined(samples))
    model = Wang2024Model.of(robot, coefficients)
    return Wang2024Fit(
        coefficients,
        tuple(_score(model, *pair) for pair in zip(drives, samples, strict=True)),
        tuple(_score(model, drive, samples_of(drive)) for drive in held_out),
    )


def _score(model: Wang2024Model, drive: Drive, samples: Samples) -> Line:
    known = samples.known()
    modelled = model.power(known.motion)
    pairs = [*zip(known.power.T, modelled.power.T, strict=True)]
    together = modelled.power.sum(axis=1)
    pairs.append((known.power.sum(axis=1), together))
    if known.total is not None and modelled.other is not None:
        pairs.append((known.total, together + modelled.other))
    found = [accuracy(measured, expected) for measured, expected in pairs]
    found += [np.nan] * (len(COLUMNS) - len(found))
    seconds = len(known.power) * TickSettings().period / NANOSECONDS
    return Line(drive.name, seconds, tuple(found))
