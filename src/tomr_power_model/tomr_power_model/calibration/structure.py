"""What a fit leaves, and what it depends on: missing physics biases the values that are fitted."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import determined, modelled_power
from tomr_power_model.calibration.samples import Samples
from tomr_power_model.estimation.statistics import autocorrelation_time
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_BINS = 15
_SHARE = 0.1  # of the residual's variance
_NOTABLE, _MUCH = 5e-3, 0.015  # of the power, rms
_SURELY = 5.0  # times the share that noise has by chance
_LATE = 0.01  # s
_FEWEST = 50 * _BINS  # samples


def structure_warnings(samples: Sequence[Samples], robot: Robot) -> list[str]:
    """One line if residuals of motor power depend on speed, load or time, one per late sensor."""
    found: dict[str, tuple[float, str]] = {}
    late = []
    for wheel in range(WHEELS):
        residual, power, change, variables = _residuals(samples, robot, wheel)
        if len(residual) < _FEWEST:
            continue
        delay = -float(residual @ change) / max(float(change @ change), 1e-12)
        rest = residual + delay * change
        if abs(delay) > _LATE and float(rest @ rest) < (1.0 - _SHARE) * float(residual @ residual):
            late.append(
                f"{robot.wheel_topics[wheel]}/power comes {1e3 * abs(delay):.0f} ms or more "
                f"{'late' if delay > 0.0 else 'early'} against joint_states: mend its stamps, or "
                "run tomr_gap explain, which fits sensor.clock_offset"
            )
        for name, values in variables.items():
            share, chance = _explained(values, residual)
            if _is_structure(share, float(np.std(residual)) / max(_rms(power), 1e-9), chance):
                found[name] = max(found.get(name, (0.0, "")), (share, robot.wheel_names[wheel]))
    if found:
        name, (share, where) = max(found.items(), key=lambda item: item[1])
        late.append(
            f"values may be biased by missing physics: run tomr_gap explain ({100.0 * share:.0f} % "
            f"of what the fit leaves at {where} depends on {name})"
        )
    return late


def _residuals(
    samples: Sequence[Samples], robot: Robot, wheel: int
) -> tuple[Array, Array, Array, dict[str, Array]]:
    """Residual, modelled power and its derivative, and what a residual may depend on."""
    rows = [part for item in samples for part in _of_recording(item, robot, wheel)]
    if not rows:
        return np.empty(0), np.empty(0), np.empty(0), {}
    residual, power, change, speed, acceleration, time = np.concatenate(rows, axis=1)
    variables = {"speed": speed, "load": acceleration, "time": time}
    return residual, power, change, variables


def _of_recording(item: Samples, robot: Robot, wheel: int) -> Iterator[Array]:
    known = np.isfinite(determined(item, robot)[:, wheel])
    if np.count_nonzero(known) > 2:
        power = modelled_power(robot, item.motion, item.parts)[known, wheel]
        motion, time = item.mean_motion, item.time[known]
        yield np.stack(
            [
                item.measured[known, wheel] - power,
                power,
                np.gradient(power, time),
                motion.speed[known, wheel],
                motion.acceleration[known, wheel],
                time,
            ]
        )


def _explained(values: Array, residual: Array) -> tuple[float, float]:
    """Share of a residual's variance in its means over quantiles of a variable.

    And the share that those of noise would have which is correlated as what is left is.
    """
    edges = np.quantile(values, np.arange(1, _BINS) / _BINS)
    place = np.digitize(values, edges)
    count = np.maximum(np.bincount(place, minlength=_BINS), 1)
    mean = np.bincount(place, weights=residual, minlength=_BINS) / count
    left = residual - mean[place]
    share = 1.0 - float(np.var(left)) / max(float(np.var(residual)), 1e-12)
    return share, _BINS * autocorrelation_time([left]) / len(left)


def _is_structure(share: float, residual: float, chance: float) -> bool:
    """Whether a share of a residual's variance is missing physics.

    Sensors that are noisy or coarse hide in the residual what is much of the power all the same.

    Args:
        share: of the variance.
        residual: its standard deviation, of the power's rms.
        chance: share that means of noise would have.
    """
    size = math.sqrt(max(share, 0.0)) * residual
    if share > _SHARE:
        return size > _NOTABLE
    return size > _MUCH and share > _SURELY * chance


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
