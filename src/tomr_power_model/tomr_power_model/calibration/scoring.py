"""How well a robot's model explains a recording, and what part of a misfit looks like a fault."""

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from tomr_power_model.calibration.problem import determined, modelled_power
from tomr_power_model.calibration.samples import TOTAL, Samples
from tomr_power_model.drive.motion import median_period
from tomr_power_model.drive.quality import Finding, runs
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

COLUMNS = ("motor 1", "motor 2", "motor 3", "motors", "robot")
_MEAN_ABSOLUTE = np.sqrt(2.0 / np.pi)  # of noise, over its standard deviation
_EPISODE = 1.0  # s
_OUT_OF_LINE = 4.0  # times the usual misfit
_SHARE = 0.25  # of the power drawn meanwhile
_LEAST = 0.5  # W
_LEAST_SAMPLES = 20


@frozen
class Score:
    """Figures of one recording, by column: motors 1-3, their sum, the whole robot; NaN: unknown.

    `reachable` is the accuracy that the sensor's noise leaves to a perfect model; `energy` that of
    the sums over the drive.
    """

    name: str
    seconds: float
    accuracy: tuple[float, ...]
    nrmse: tuple[float, ...]
    reachable: tuple[float, ...]
    energy: tuple[float, ...]


@frozen
class Scores:
    """Figures of several recordings, and of all their samples together; None without any."""

    drives: tuple[Score, ...]
    whole: Score | None


def columns(time: Array, power: Array) -> Array:
    """Power of motors 1-3 and of the robot, (n, 4), with the motors' sum between, (n, 5).

    Motors measured at different instants are added where the first one is measured, the others
    interpolated.
    """
    motors = power[:, :WHEELS]
    together = np.isfinite(motors).all(axis=1)
    total = motors.sum(axis=1)
    known = np.isfinite(motors)
    if not together.any() and known.any(axis=0).all():
        filled = [np.interp(time, time[k], m[k]) for m, k in zip(motors.T, known.T, strict=True)]
        total = np.where(known[:, 0], np.sum(filled, axis=0), np.nan)
    return np.column_stack([motors, total, power[:, TOTAL]])


def score(drives: Sequence[Samples], robot: Robot) -> Scores:
    """Figures of a robot's model on some recordings, every measured instant counted."""
    found, all_measured, all_modelled, seconds = [], [], [], 0.0
    drawn = []
    for item in drives:
        measured = columns(item.time, item.measured)
        modelled = columns(item.time, modelled_power(robot, item.motion, item.parts))
        lasted = float(item.time[-1] - item.time[0])
        found.append(_score(item.name, lasted, measured, modelled))
        all_measured.append(measured)
        all_modelled.append(modelled)
        drawn.append(np.nansum(np.abs(measured), axis=0))
        seconds += lasted
    if not found:
        return Scores((), None)
    whole = _score("all", seconds, np.concatenate(all_measured), np.concatenate(all_modelled))
    # Noise differs from drive to drive: it is estimated drive by drive.
    reachable = np.array([item.reachable for item in found])
    weight = np.array(drawn) * np.isfinite(reachable)
    with np.errstate(invalid="ignore"):
        mean = (np.nan_to_num(reachable) * weight).sum(axis=0) / weight.sum(axis=0)
    return Scores(tuple(found), evolve(whole, reachable=tuple(float(value) for value in mean)))


def _score(name: str, seconds: float, measured: Array, modelled: Array) -> Score:
    pairs = list(zip(measured.T, modelled.T, strict=True))
    return Score(
        name,
        seconds,
        tuple(accuracy(ours, model) for ours, model in pairs),
        tuple(nrmse(ours, model) for ours, model in pairs),
        tuple(_reachable(ours, model) for ours, model in pairs),
        tuple(_energy(ours, model) for ours, model in pairs),
    )


def median_energy(scores: Scores) -> tuple[float, ...]:
    """Accuracy of the energy of a drive, the median over drives, by column."""
    return tuple(float(value) for value in np.median([d.energy for d in scores.drives], axis=0))


def _energy(measured: Array, modelled: Array) -> float:
    known = np.isfinite(measured) & np.isfinite(modelled)
    drawn = float(measured[known].sum())
    return 1.0 - abs(float(modelled[known].sum()) - drawn) / abs(drawn) if drawn else float("nan")


def _reachable(measured: Array, modelled: Array) -> float:
    """Accuracy left by noise that is independent from sample to sample."""
    known = np.isfinite(measured) & np.isfinite(modelled)
    rest, drawn = (measured - modelled)[known], float(np.abs(measured[known]).sum())
    if len(rest) < 3 or not drawn:
        return float("nan")
    # Second differences of a smooth misfit vanish; those of noise have sqrt(6) its deviation. The
    # lower quartile, 0.3186 deviations, leaves out where the power jumps.
    bend = rest[:-2] - 2.0 * rest[1:-1] + rest[2:]
    noise = float(np.percentile(np.abs(bend), 25)) / (0.3186 * np.sqrt(6.0))
    return 1.0 - float(_MEAN_ABSOLUTE * noise) * len(rest) / drawn


def suspicious(samples: Samples, robot: Robot) -> Iterator[Finding]:
    """Stretches whose power is far from the fitted model for a second or more."""
    modelled = modelled_power(robot, samples.motion, samples.parts)
    measured = determined(samples, robot)
    has_motors = bool(np.isfinite(measured[:, :WHEELS]).any())
    names = robot.wheel_names if has_motors else ("",) * WHEELS + ("the whole robot",)
    for wheel, name in enumerate(names):
        known = np.isfinite(measured[:, wheel])
        time = samples.time[known]
        if len(time) < _LEAST_SAMPLES:
            continue
        drawn, model = measured[known, wheel], modelled[known, wheel]
        misfit = np.abs(drawn - model)
        usual, lasting = float(np.median(misfit)), _lasting(time, misfit)
        level = np.maximum(_lasting(time, np.abs(drawn)), _lasting(time, np.abs(model)))
        far = (lasting > _OUT_OF_LINE * usual) & (lasting > np.maximum(_SHARE * level, _LEAST))
        for first, last in runs(far, time, _EPISODE, bridge=0.3):
            rows = slice(first, last + 1)
            start, end = float(time[first]), float(time[last])
            yield Finding(
                samples.name,
                name,
                start,
                end,
                f"it draws {np.mean(drawn[rows]):.1f} W and the fitted model says "
                f"{np.mean(model[rows]):.1f} W, {np.mean(misfit[rows]):.1f} W off from instant to "
                f"instant, {usual:.2f} W is usual",
                f"leave it out with --skip {samples.name}={max(0.0, start - 1.0):.1f}:"
                f"{end + 1.0:.1f} if something was wrong with the robot there",
            )


def _lasting(time: Array, values: Array) -> Array:
    """Median over a second around each instant: what lasts, short peaks left out, (n,)."""
    size = max(3, round(_EPISODE / median_period(time)))
    return np.asarray(median_filter(values, size, mode="nearest"))
