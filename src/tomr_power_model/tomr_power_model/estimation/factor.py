"""The Cholesky factor of a posterior's information."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor

Array = NDArray[np.float64]

_ROUNDING = 1e-10  # of a squared column, by which sums of many terms may be off


def posterior_factor(information: Array) -> tuple[Array, bool]:
    """Of I + A^T A, for scipy's `cho_solve`; `information`: A^T A of the data, (p, p).

    Where columns of A are alike and so large that rounding outweighs the prior, they are
    distinguished by as much as rounding may be.
    """
    matrix = information + np.eye(len(information))
    try:
        factor, lower = cho_factor(matrix, lower=True)
    except np.linalg.LinAlgError:
        rounding = np.diag(_ROUNDING * np.diag(matrix))
        factor, lower = cho_factor(matrix + rounding, lower=True)
    return np.asarray(factor), bool(lower)
