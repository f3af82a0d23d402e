"""The loss: quadratic for usual residuals, linear for the few large ones (soft L1)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_KNEE = 3.0  # standard deviations at which it turns


def bent(standard: Array, robust: bool = True) -> Array:
    """The root of the loss with its sign: x within the knee, growing as sqrt(|x|) beyond."""
    if not robust:
        return standard
    loss = 2.0 * (np.sqrt(1.0 + (standard / _KNEE) ** 2) - 1.0)
    return np.asarray(np.sign(standard) * _KNEE * np.sqrt(loss))


def influence(standard: Array, robust: bool = True) -> tuple[Array, Array]:
    """psi, the derivative of half the loss, and psi', its curvature."""
    if not robust:
        return standard, np.ones_like(standard)
    flat = 1.0 / np.sqrt(1.0 + (standard / _KNEE) ** 2)
    return standard * flat, flat**3
