"""Statistics of residuals."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

Array = NDArray[np.float64]


def robust_std(values: Array) -> float:
    """Standard deviation about zero of what is normal but for outliers."""
    return float(median_abs_deviation(values, center=lambda x, axis: 0.0, scale="normal"))


def autocorrelation(pieces: Sequence[Array], lags: int | None = None) -> Array:
    """Of residuals about zero, from lag 0 on; pairs do not reach from one piece into the next.

    The mean is not taken off: an offset that lasts a whole drive is the most correlated of all.
    """
    longest = max(len(piece) for piece in pieces)
    products = np.zeros(longest)
    for piece in pieces:
        size = 1 << (2 * len(piece) - 1).bit_length()
        power = np.abs(np.fft.rfft(piece, size)) ** 2
        products[: len(piece)] += np.fft.irfft(power, size)[: len(piece)]
    share = products / products[0] if products[0] > 0.0 else np.eye(1, longest)[0]
    return np.asarray(share[:lags])


def autocorrelation_time(
    pieces: Sequence[Array], lags: int | None = None, negligible: float | None = None
) -> float:
    """1 + 2 sum_k rho_k in samples: n correlated samples count as n over it.

    Args:
        pieces: series without gaps.
        lags: at most summed; None: half of the longest piece.
        negligible: sum up to the first lag below; None: until two lags in a row leave nothing
            (Geyer 1992).
    """
    rho = autocorrelation(pieces, lags or max(2, max(len(piece) for piece in pieces) // 2))
    if negligible is None:
        pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
        stop = 2 * (int(np.argmax(pairs <= 0.0)) if np.any(pairs <= 0.0) else len(pairs))
    else:
        stop = int(np.argmax(rho < negligible)) if np.any(rho < negligible) else len(rho)
    return max(1.0, 2.0 * float(rho[:stop].sum()) - 1.0)
