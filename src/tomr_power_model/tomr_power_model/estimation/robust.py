"""The soft L1 loss: quadratic for usual residuals, linear for the few large ones."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_KNEE = 3.0  # standard deviations at which it turns


def soft_l1(standard: Array, robust: bool = True) -> tuple[Array, Array]:
    """The root of the loss with its sign, and its derivative by the standard residual.

    The root is x within the knee and grows as sqrt(|x|) beyond: its square is the loss.
    """
    if not robust:
        return standard, np.ones_like(standard)
    # sqrt(1 + q) - 1 without the cancellation of small q.
    flat = np.sqrt(1.0 + (standard / _KNEE) ** 2)
    shrink = np.sqrt(2.0 / (flat + 1.0))
    return standard * shrink, 1.0 / (flat * shrink)


def influence(standard: Array, robust: bool = True) -> tuple[Array, Array]:
    """psi, the derivative of half the loss, and psi', its curvature."""
    if not robust:
        return standard, np.ones_like(standard)
    flat = 1.0 / np.sqrt(1.0 + (standard / _KNEE) ** 2)
    return standard * flat, flat**3
