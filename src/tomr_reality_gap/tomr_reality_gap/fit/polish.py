"""A law's parameters brought to their best with the simulator: a table is too coarse for them."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.robot import Robot
from tomr_power_model.unmodelled import LearntTerm, Motion
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.law_forms import SIZES
from tomr_reality_gap.fit.laws import LawAt
from tomr_reality_gap.fit.learnt import power_rows
from tomr_reality_gap.fit.remainder import Remainder

Array = NDArray[np.float64]

_ROUNDS = 10
_ENOUGH = 1e-4  # of the squares left: a step that promises less is not taken
_FACTOR = 1.0  # logarithm of the most that a step makes of a size
_STEP = 0.02  # of a parameter, to either side, for its derivative
_LEAST = 0.005  # the same, in its unit, of what may be nothing: places, speeds, angles


def changes_of(
    dataset: Dataset, robot: Robot, motions: Sequence[Motion], terms: Sequence[LearntTerm]
) -> Array:
    """What each of some terms adds to every value, (v, n)."""
    found = [[term.actions(motion) for term in terms] for motion in motions]
    if terms[0].family.acts in ("torque", "force"):
        torques = [[np.stack([item.torque for item in row])] for row in found]
        return np.asarray(dataset.changes(robot, torques), dtype=np.float64)
    return np.concatenate(
        [
            np.stack([power_rows(simulation, item) for item in row])
            for simulation, row in zip(dataset.simulations, found, strict=True)
        ],
        axis=1,
    )


def best_law(
    rest: Remainder,
    tried: Sequence[LawAt],
    robot: Robot,
    motions: Sequence[Motion],
    *,
    inflation: float,
    enough: float,
) -> tuple[LawAt, Array, float]:
    """The first law that explains enough at its best, or the one that explains most.

    A stiff tether pulls the robot off its way: only at its best such a law explains as much as its
    table.

    Args:
        rest: what is left of recordings.
        tried: laws, the first ones first.
        robot: of which it is left.
        motions: of the robot in the recordings.
        inflation: of the parameters' variance.
        enough: share of the squares that are left.

    Returns:
        The law, what it adds to every value, (n,), and the share that it explains.
    """
    found = []
    for law in tried:
        best, shown = polished(law, rest, robot, motions, inflation=inflation)
        found.append((best, shown, rest.explained(shown)))
        if found[-1][2] > enough:
            break
    return max(found, key=lambda item: item[2])


def polished(
    law: LawAt,
    rest: Remainder,
    robot: Robot,
    motions: Sequence[Motion],
    *,
    inflation: float,
) -> tuple[LawAt, Array]:
    """The law at its best, and what it adds to every value, (n,).

    Args:
        law: where to start.
        rest: what is left of recordings without it.
        robot: of which it is left.
        motions: of the robot in the recordings.
        inflation: of the parameters' variance.
    """
    # However small a size is, a step is a part of it.
    least = np.array([1e-12 if name in SIZES else _LEAST for name in law.law.units])
    best, change, cost = law, np.zeros_like(rest.residual), np.inf
    step = np.zeros_like(law.parameters)
    for _ in range(_ROUNDS):
        steps = np.maximum(_STEP * np.abs(law.parameters), least)
        rows = changes_of(rest.dataset, robot, motions, _around(law, steps)) * rest.weight
        left = rest.beyond_base(rest.residual - rows[0])
        now = float(left @ left)
        if not now < cost:  # the last step was too long
            step = 0.5 * step
            law = _moved(best, step)
            continue
        # An exponent bends what it shows, and an edge has none but small corners.
        up, down = np.split(rows[1:], 2)
        jacobian = rest.beyond_base((up - down).T / (2.0 * steps))
        information = jacobian.T @ jacobian
        covariance = np.asarray(np.linalg.pinv(information), dtype=np.float64)
        best = evolve(law, covariance=covariance * inflation)
        change, cost = rows[0] / rest.weight, now
        slope = jacobian.T @ left
        step = covariance @ slope
        if float(step @ slope) < _ENOUGH * now:
            break
        law = _moved(law, step)
    return best, change


def _around(law: LawAt, steps: Array) -> list[LearntTerm]:
    """The law's term, then those with each parameter a step above, and a step below."""
    both = np.concatenate([np.diag(steps), -np.diag(steps)])
    return [law.term, *(evolve(law, parameters=law.parameters + row).term for row in both)]


def _moved(law: LawAt, step: Array) -> LawAt:
    """The law after a step, of which a size takes a part of it: its logarithm and an exponent
    trade places along a line, it itself along a curve.
    """
    parameters = law.parameters + step
    for number, name in enumerate(law.law.units):
        size = law.parameters[number]
        if name in SIZES and size:
            parameters[number] = size * np.exp(np.clip(step[number] / size, -_FACTOR, _FACTOR))
    return evolve(law, parameters=parameters)
