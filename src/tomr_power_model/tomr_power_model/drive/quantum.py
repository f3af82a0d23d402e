"""How coarse a sensor is, as its readings show it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EXACT = 9  # decimals of a reading: what differs by less is one level
_SAME = 1e-6  # rad: two steps that differ by less are alike


def quantum_of(reading: Array) -> float:
    """Usual distance from a reading to the next level that is read, in its unit; 0: one level.

    Of a sensor that is finer than its noise it is next to nothing. NaN are left out.
    """
    known = reading[np.isfinite(reading)]
    levels, level = np.unique(np.round(known, _EXACT), return_inverse=True)
    if len(levels) < 2:
        return 0.0
    steps = np.diff(levels)
    nearest = np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))
    return float(np.median(nearest[level]))


def count_of(position: Array) -> float:
    """By which the angles of encoders go, as samples show it [rad], (n, m); 0: they do not.

    Whole counts: what steps differ by is one of them at least.
    """
    uneven = np.abs(np.diff(position, n=2, axis=0))
    differing = uneven[uneven > _SAME]
    return float(differing.min()) if len(differing) else 0.0
