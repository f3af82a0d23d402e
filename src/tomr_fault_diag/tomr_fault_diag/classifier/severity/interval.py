"""A quantity with its interval."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST = 4  # stretches that an interval needs
_NOTHING = 1e-9  # of what the stretch that shows most does: one of less shows nothing


@frozen
class Severity:
    """A quantity and its interval of 95 %; shares are of 1."""

    quantity: str
    unit: str  # empty: a share
    value: float
    low: float
    high: float

    @property
    def words(self) -> str:
        """As a reader wants it: winding resistance +80 % (+72 to +88 %)."""
        numbers = (self.value, self.low, self.high)
        if not self.unit:
            value, low, high = (f"{100.0 * number:+.0f}" for number in numbers)
            return f"{self.quantity} {value} % ({low} to {high} %)"
        value, low, high = (f"{number:.3g}" for number in numbers)
        return f"{self.quantity} {value} {self.unit} ({low} to {high} {self.unit})"


def slope(squares: Array, products: Array) -> tuple[float, float] | None:
    """Slope of a line through the origin, and half its interval; None where too little shows it.

    Args:
        squares: of the independent quantity, summed over each stretch, (n,).
        products: of it with the dependent one, likewise.
    """
    kept = squares > _NOTHING * squares.max(initial=0.0)
    x, y = squares[kept], products[kept]
    if len(x) < _LEAST:
        return None
    others = (y.sum() - y) / (x.sum() - x)
    return float(y.sum() / x.sum()), float(jackknife_half(others))


def jackknife_half(others: Array) -> Array:
    """Half an interval of 95 %, (...), of estimates that leave out one of n parts each, (n, ...).

    Independent parts; n at least 2 (Efron and Tibshirani 1993, Eq. 11.5).
    """
    count = len(others)
    spread = ((others - others.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(student(count - 1) * np.sqrt((count - 1.0) / count * spread))


def student(freedom: int) -> float:
    """97.5 % quantile of Student's t, by Cornish and Fisher (0.5 % off at 3 degrees).

    scipy.special, which has it, takes a node 15 MB and a quarter of a second.
    """
    z = 1.959964
    return (
        z
        + (z**3 + z) / (4.0 * freedom)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * freedom**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * freedom**3)
    )
