"""Robust scales and correlation of residuals."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

Array = NDArray[np.float64]


def robust_scale(residual: Array) -> float:
    """Standard deviation of residuals about zero, from their median magnitude; NaN are left out."""
    return float(
        median_abs_deviation(
            residual, center=lambda values, axis: 0.0, scale="normal", nan_policy="omit"
        )
    )


def autocorrelation_time(pieces: Sequence[Array]) -> float:
    """1 + 2 sum_k rho_k in samples, summed until two lags in a row leave nothing (Geyer 1992).

    The mean is not taken off: an offset that lasts a whole drive is the most correlated of all.

    Args:
        pieces: uninterrupted series, NaN where unknown, each (n,).
    """
    longest = max(len(piece) for piece in pieces)
    products = np.zeros(longest)
    for piece in pieces:
        known = np.where(np.isfinite(piece), piece, 0.0)
        size = 1 << (2 * len(known) - 1).bit_length()
        power = np.abs(np.fft.rfft(known, size)) ** 2
        products[: len(known)] += np.fft.irfft(power, size)[: len(known)]
    if products[0] <= 0.0:
        return 1.0
    rho = products[: max(2, longest // 2)] / products[0]
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    stop = int(np.argmax(pairs <= 0.0)) if np.any(pairs <= 0.0) else len(pairs)
    return max(1.0, 2.0 * float(pairs[:stop].sum()) - 1.0)
