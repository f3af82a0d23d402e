"""A calibration from recordings to figures: read, check, fit, score."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.fit import Fit, fit
from tomr_power_model.calibration.identify import warnings_of
from tomr_power_model.calibration.parameters import Choice, choose
from tomr_power_model.calibration.problem import Problem
from tomr_power_model.calibration.samples import TOTAL, Samples, samples_of
from tomr_power_model.calibration.scoring import Scores, score, suspicious
from tomr_power_model.calibration.span import span_warnings
from tomr_power_model.calibration.structure import structure_warnings
from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.cut import Skips, names_of, without
from tomr_power_model.drive.quality import Finding
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, Values, prior_stds
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_MOST_NOTES = 4
_WORST_SHARE = 0.05  # of the time that may look like a fault
_ONE_PIECE = 0.4  # of such time


@frozen
class Timing:
    """How motion and power are brought to the same instants [s]."""

    span: float | None = None  # of the fit to the encoders; None: `span_of` a drive
    window: float | None = None  # of the power sensor; None: sensors.power_window


@frozen
class Result:
    """All that a calibration found."""

    robot: Robot  # fitted
    parameters: tuple[Parameter, ...]
    fitted: Fit
    samples: tuple[Samples, ...]
    held_out: tuple[Samples, ...]
    scores: Scores
    scores_before: Scores  # of the description as it was
    held_out_scores: Scores
    held_out_scores_before: Scores
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def half_widths(self) -> Array:
        """Half of the 95 % intervals, in the values' units."""
        found = self.fitted.uncertainty
        return np.asarray(found.factor * found.deviation * prior_stds(self.parameters))


def read_all(
    paths: Sequence[Path],
    robot: Robot,
    namespace: str | None,
    skips: Skips,
    *,
    tick: Callable[[], None] = lambda: None,
) -> tuple[Drive, ...]:
    """Read recordings and cut out what is to be skipped. Raises InputError."""
    found = []
    for path, name in zip(paths, names_of(paths), strict=True):
        drive = evolve(read_drive(path, robot, namespace), name=name)
        found.append(without(cleaned(drive, robot), skips.get(name, ())))
        tick()
    return tuple(found)


def align(drives: Sequence[Drive], robot: Robot, timing: Timing) -> tuple[Samples, ...]:
    """Samples of recordings. Raises InputError for one whose power and encoders never meet."""
    found = []
    for item in drives:
        samples = samples_of(item, robot, timing.span, timing.window)
        if not len(samples.time):
            raise InputError(
                f"{item.name}: no power sample falls between encoder samples: are both stamped by "
                "the same clock?"
            )
        found.append(samples)
    return tuple(found)


def calibrate(
    values: Values,
    place: str,
    samples: Sequence[Samples],
    held_out: Sequence[Samples],
    *,
    choice: Choice,
    robust: bool = True,
    tick: Callable[[], None] = lambda: None,
) -> Result:
    """Fit a description to samples and score it on others. Raises InputError."""
    described = ParameterisedRobot(values, place)
    before = described.robot
    measured = [np.isfinite(item.measured) for item in samples]
    choice = evolve(
        choice,
        quantity=before.measurement.quantity,
        has_total=any(item[:, TOTAL].any() for item in measured),
    )
    parameters = tuple(choose(values, before.wheel_names, choice, place))
    problem = Problem(described, parameters, tuple(samples))
    fitted = fit(problem, robust, tick)
    robot = problem.robot(fitted.numbers)
    findings = [found for item in samples for found in suspicious(item, robot)]
    _refuse_episode(findings, samples)
    elsewhere = [found for item in held_out for found in suspicious(item, robot)]
    return Result(
        robot=robot,
        parameters=parameters,
        fitted=fitted,
        samples=tuple(samples),
        held_out=tuple(held_out),
        scores=score(samples, robot),
        scores_before=score(samples, before),
        held_out_scores=score(held_out, robot),
        held_out_scores_before=score(held_out, before),
        warnings=(
            *span_warnings([item.span for item in (*samples, *held_out)]),
            *structure_warnings((*samples, *held_out), robot),
            *warnings_of(parameters, fitted, robot.wheel_names),
        ),
        notes=_in_words([*findings, *elsewhere]),
    )


def _in_words(findings: Sequence[Finding]) -> tuple[str, ...]:
    """The longest ones in words, and how many more there are."""
    ordered = sorted(findings, key=lambda found: found.start - found.end)
    more = len(ordered) - _MOST_NOTES
    notes = [str(found) for found in ordered[:_MOST_NOTES]]
    return (*notes, f"{more} shorter stretches are like that") if more > 0 else tuple(notes)


def _refuse_episode(findings: Sequence[Finding], samples: Sequence[Samples]) -> None:
    """Raise InputError where much of the time is out of line, and mostly in one piece.

    Something happened there; what a model leaves out comes back wherever the robot drives alike.
    """
    total = sum(float(item.time[-1] - item.time[0]) for item in samples)
    odd = sum(found.end - found.start for found in findings)
    if odd > _WORST_SHARE * total:
        longest = max(findings, key=lambda found: found.end - found.start)
        if longest.end - longest.start > _ONE_PIECE * odd:
            raise InputError(f"{longest} ({odd:.0f} s of {total:.0f} s are like that)")
