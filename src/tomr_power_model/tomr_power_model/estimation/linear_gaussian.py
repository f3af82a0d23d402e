"""Linear Gaussian models of a mismatch: what each set of columns explains, and its evidence.

With whitened data r (residuals / sigma), columns A of derivatives scaled by the prior standard
deviation of each parameter, and parameters x ~ N(0, 1), the log evidence against no columns is

    L = 1/2 b^T (I + G)^-1 b - 1/2 log|I + G|,   G = A^T A,  b = A^T r

(Bishop 2006, Eq. 3.86, for known noise). Any subset of columns needs only its part of G and b.
"""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.linalg import cho_solve

from tomr_power_model.estimation.factor import posterior_factor

Array = NDArray[np.float64]
Matrix = NDArray[np.float32] | Array  # columns may be stored in single precision

AT_A_TIME = 2048  # rows that are taken in double precision


@frozen
class Gram:
    """Normal equations of all columns."""

    matrix: Array  # (p, p)
    vector: Array  # (p,)
    square: float  # r^T r

    @classmethod
    def of(
        cls,
        columns: Matrix,
        residual: Array,
        weight: Array | None = None,
        chosen: NDArray[np.intp] | None = None,
    ) -> "Gram":
        """From columns (n, p), in prior standard deviations, and residuals (n,).

        Both are whitened already, or to be multiplied by `weight`, (n,); `chosen`: of some columns.
        """
        count = columns.shape[1] if chosen is None else len(chosen)
        matrix, vector = np.zeros((count, count)), np.zeros(count)
        weight = np.ones(len(residual)) if weight is None else weight
        whitened = residual * weight
        for first in range(0, len(residual), AT_A_TIME):
            rows = slice(first, first + AT_A_TIME)
            own = columns[rows] if chosen is None else columns[rows, chosen]
            part = own * weight[rows, None]
            matrix += part.T @ part
            vector += part.T @ whitened[rows]
        return cls(matrix, vector, float(whitened @ whitened))

    def scaled(self, scale: Array) -> "Gram":
        """Of columns times `scale`, (p,): of parameters with other prior standard deviations."""
        return Gram(self.matrix * np.outer(scale, scale), self.vector * scale, self.square)


def product(columns: Matrix, units: Array) -> Array:
    """Columns (n, p) times units (p,), or several of them (p, k), in double precision."""
    parts = [columns[row : row + AT_A_TIME] @ units for row in range(0, len(columns), AT_A_TIME)]
    return np.concatenate([np.empty((0, *units.shape[1:])), *parts])


def transposed_product(columns: Matrix, values: Array) -> Array:
    """Columns (n, p), transposed, times values (n,), in double precision."""
    found = np.zeros(columns.shape[1])
    for row in range(0, len(columns), AT_A_TIME):
        found += values[row : row + AT_A_TIME] @ columns[row : row + AT_A_TIME]
    return found


@frozen
class Solution:
    """Posterior of one subset of columns, in units of their prior standard deviations."""

    evidence: float  # log, against no columns
    mean: Array  # (k,)
    factor: tuple[Array, bool]  # Cholesky factor of I + G

    @property
    def covariance(self) -> Array:
        """Of the mean, (k, k)."""
        return np.asarray(cho_solve(self.factor, np.eye(len(self.mean))))


def solve(gram: Gram, chosen: Sequence[int]) -> Solution:
    """Posterior of a subset of columns."""
    rows = np.asarray(chosen, dtype=np.intp)
    factor = posterior_factor(gram.matrix[np.ix_(rows, rows)])
    mean = cho_solve(factor, gram.vector[rows])
    explained = float(gram.vector[rows] @ mean)
    value = 0.5 * explained - float(np.log(np.diag(factor[0])).sum())
    return Solution(value, mean, factor)
