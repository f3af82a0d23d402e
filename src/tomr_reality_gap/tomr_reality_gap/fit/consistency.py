"""Whether recordings can be of one robot: each explained by itself, the parameters are compared."""

from itertools import combinations

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.estimation.linear_gaussian import Gram, solve
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Round

Array = NDArray[np.float64]

# What stays from one drive to the next: floors, temperatures and supplies may differ.
_LASTING = ("robot.mass", "robot.inertia_z", "torque_constant")
_BEYOND = 10.0  # tolerances that a recording by itself may move a parameter
_LONG = 30.0  # s: a short drive is one motion, and shows the floor under it, not the robot
_APART = 0.15  # of a value: two recordings that differ more ...
_SURE = 6.0  # ... by so many standard deviations are of different robots
_SAME = 0.2  # of a finding's response that is none of these parameters': less is theirs


@frozen
class _Estimate:
    """A parameter as one recording has it, relative to the description's."""

    value: float
    deviation: float


def check_same_robot(dataset: Dataset, last: Round) -> None:
    """Raise InputError where two recordings ask for different robots.

    Args:
        dataset: the recordings.
        last: the search's last round: the linear model around all that was found.
    """
    long = [at for at, item in enumerate(dataset.simulations) if item.recorded.duration > _LONG]
    estimates = {number: _estimates(dataset, last, number) for number in long}
    for one, other in combinations(long, 2):
        for key, first in estimates[one].items():
            second = estimates[other][key]
            apart = second.value - first.value
            sigma = float(np.hypot(first.deviation, second.deviation))
            if abs(apart) > max(_APART, _SURE * sigma):
                names = [dataset.simulations[item].recorded.name for item in (one, other)]
                raise InputError(
                    f"{names[0]} and {names[1]}: they ask for values of {key} that lie "
                    f"{100.0 * abs(apart):.0f} % apart: recordings of different robots, or of one "
                    "that was changed in between: explain them one at a time"
                )


def _estimates(dataset: Dataset, last: Round, number: int) -> dict[str, _Estimate]:
    """What one recording says by itself about the parameters that last."""
    jacobian, weight = last.jacobian, last.noise.weight
    first = sum(item.size for item in dataset.simulations[:number])
    rows = slice(first, first + dataset.simulations[number].size)
    kept = jacobian.kept
    matrix = jacobian.matrix[rows, :kept].astype(np.float64)
    matrix[:, jacobian.nuisance] *= _BEYOND
    values = jacobian.model.described.values
    lasting = {
        row: (item.keys[0], _BEYOND * item.prior_std / abs(value))
        for row, item in enumerate(jacobian.model.nuisances)
        if item.keys[0].endswith(_LASTING) and isinstance(value := values[item.keys[0]], float)
    }
    matrix[:, _doubles(matrix * weight[rows, None], [*lasting], jacobian.sensors.stop)] = 0.0
    residual = dataset.value[rows] - jacobian.value[rows]
    solution = solve(Gram.of(matrix, residual, weight[rows]), range(kept))
    return {
        key: _Estimate(
            unit * float(solution.mean[row]), unit * float(np.sqrt(solution.covariance[row, row]))
        )
        for row, (key, unit) in lasting.items()
    }


def _doubles(matrix: Array, lasting: list[int], first: int) -> list[int]:
    """Columns from the first finding's on that respond as parameters that last do: a wrong mass and
    the tolerance of the mass could be anything together, but for what they are in all."""
    own = matrix[:, first:]
    if not lasting or not own.size:
        return []
    theirs = matrix[:, lasting]
    left = own - theirs @ np.linalg.lstsq(theirs, own, rcond=None)[0]
    sizes = np.linalg.norm(own, axis=0)
    return [int(first + at) for at in np.flatnonzero(np.linalg.norm(left, axis=0) < _SAME * sizes)]
