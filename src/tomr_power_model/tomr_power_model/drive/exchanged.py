"""Powers of motors under each other's names: a motor draws by how its own wheel turns."""

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_LEAST = 100  # samples
_BETTER = 0.6  # of the three shares that are explained, together
_EXPLAINED = 0.6  # of each, so exchanged; a motor that is not well hardly goes with anything


def draws_by(speed: Array, time: Array) -> Array:
    """What a motor's power depends on by its wheel's motion alone: friction, copper, inertia.

    Args:
        speed: of each wheel [rad/s], (n, 3).
        time: of each row [s], (n,).

    Returns: for each row and wheel, (n, 3, 3).
    """
    return np.stack([np.abs(speed), speed**2, speed * np.gradient(speed, time, axis=0)], axis=2)


def exchanged(power: Array, expected: Array) -> tuple[int, ...] | None:
    """The wheel whose motor each power is of, where they are exchanged; None where they are not.

    Args:
        power: of each motor [W] or [A], (n, 3), NaN where unknown.
        expected: what it depends on linearly by each wheel, (n, 3, k), the same.
    """
    at_all = np.isfinite(expected).all(axis=(1, 2))
    known = [at_all & np.isfinite(of_motor) for of_motor in power.T]
    if min(map(np.count_nonzero, known)) < _LEAST:
        return None
    shares = np.array(
        [
            [_explained(of_motor[rows], expected[rows, wheel]) for wheel in range(WHEELS)]
            for of_motor, rows in zip(power.T, known, strict=True)
        ]
    )
    totals = {
        order: float(sum(shares[motor, wheel] for motor, wheel in enumerate(order)))
        for order in permutations(range(WHEELS))
    }
    own = tuple(range(WHEELS))
    best = max(totals, key=totals.__getitem__)
    is_clear = min(shares[motor, wheel] for motor, wheel in enumerate(best)) > _EXPLAINED
    return best if is_clear and totals[best] > totals[own] + _BETTER else None


def _explained(power: Array, expected: Array) -> float:
    """Share of a motor's variance, (n,), that columns (n, k) explain."""
    features = np.column_stack([np.ones(len(power)), expected])
    shape, *_ = np.linalg.lstsq(features, power, rcond=None)
    if len(shape) == 2 and shape[1] <= 0.0:  # down a slope, say
        return 0.0
    return float(1.0 - np.var(power - features @ shape) / max(float(np.var(power)), 1e-12))


def exchange_words(order: tuple[int, ...], robot: Robot) -> tuple[str, str]:
    """What is seen of powers that are exchanged, and what to mend."""
    pairs = [
        f"the power of {robot.wheel_topics[motor]} is that of {robot.wheel_names[wheel]}"
        for motor, wheel in enumerate(order)
        if motor != wheel
    ]
    return ", ".join(pairs), "exchange the sensors' plugs, or remap the topics"
