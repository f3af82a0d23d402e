"""Whether recordings can be of one robot: each explained by itself, the parameters are compared."""

from itertools import combinations

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.search import Round
from tomr_reality_gap.fit.study import Study

Array = NDArray[np.float64]

# What stays from one drive to the next: floors, temperatures and supplies may differ.
_LASTING = ("robot.mass", "robot.inertia_z", "torque_constant")
_BEYOND = 10.0  # tolerances that a recording by itself may turn a parameter
_LONG = 30.0  # s: a short drive is one motion, and tells the floor under it, not the robot
_APART = 0.15  # of a value: two recordings that differ more ...
_SURE = 6.0  # ... by so many standard deviations are of different robots


@frozen
class _Told:
    """A parameter as one recording tells it, relative to the description's."""

    value: float
    deviation: float


def refuse_strangers(study: Study, last: Round) -> None:
    """Raise InputError where two recordings ask for different robots.

    Args:
        study: the recordings.
        last: the search's last round: the linear model around all that was found.
    """
    long = [at for at, item in enumerate(study.simulations) if item.recorded.duration > _LONG]
    told = {number: _told(study, last, number) for number in long}
    for one, other in combinations(long, 2):
        for key, (first, second) in _pairs(told[one], told[other]).items():
            apart = second.value - first.value
            sigma = float(np.hypot(first.deviation, second.deviation))
            if abs(apart) > max(_APART, _SURE * sigma):
                names = [study.simulations[item].recorded.name for item in (one, other)]
                raise InputError(
                    f"{names[0]} and {names[1]}: they ask for values of {key} that lie "
                    f"{100.0 * abs(apart):.0f} % apart: recordings of different robots, or of one "
                    "that was changed in between: explain them one at a time"
                )


def _pairs(one: dict[str, _Told], other: dict[str, _Told]) -> dict[str, tuple[_Told, _Told]]:
    return {key: (value, other[key]) for key, value in one.items() if key in other}


def _told(study: Study, last: Round, number: int) -> dict[str, _Told]:
    """What one recording says by itself about the parameters that last."""
    columns, weight = last.columns, last.noise.weight
    sizes = [sum(len(channel.time) for channel in item.channels) for item in study.simulations]
    first = sum(sizes[:number])
    rows = slice(first, first + sizes[number])
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    matrix = columns.matrix[rows, :kept].astype(np.float64)
    matrix[:, columns.nuisance] *= _BEYOND
    residual = study.value[rows] - columns.value[rows]
    found = solve(Gram.of(matrix, residual, weight[rows]), range(kept))
    values = columns.model.described.values
    told = {}
    for row, knob in enumerate(columns.model.nuisances):
        key = knob.keys[0]
        value = values[key]
        if key.endswith(_LASTING) and isinstance(value, float):
            unit = _BEYOND * knob.spread / abs(value)
            deviation = float(np.sqrt(found.covariance[row, row]))
            told[key] = _Told(unit * float(found.mean[row]), unit * deviation)
    return told
