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
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]


@frozen
class Gram:
    """Normal equations of all columns."""

    matrix: Array  # (p, p)
    vector: Array  # (p,)
    square: float  # r^T r

    @classmethod
    def of(cls, columns: Array, residual: Array) -> "Gram":
        """From whitened columns (n, p), in prior standard deviations, and residuals (n,)."""
        return cls(columns.T @ columns, columns.T @ residual, float(residual @ residual))


@frozen
class Solution:
    """Posterior of one subset of columns, in units of their prior standard deviations."""

    evidence: float  # log, against no columns
    mean: Array  # (k,)
    covariance: Array  # (k, k)


def solve(gram: Gram, chosen: Sequence[int]) -> Solution:
    """Posterior of a subset of columns."""
    rows = np.asarray(chosen)
    factor = cho_factor(gram.matrix[np.ix_(rows, rows)] + np.eye(len(rows)), lower=True)
    mean = cho_solve(factor, gram.vector[rows])
    explained = float(gram.vector[rows] @ mean)
    value = 0.5 * explained - float(np.log(np.diag(factor[0])).sum())
    return Solution(value, mean, cho_solve(factor, np.eye(len(rows))))
