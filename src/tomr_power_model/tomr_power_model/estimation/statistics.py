"""Robust scales and correlation of residuals."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

Array = NDArray[np.float64]


def robust_scale(residual: Array) -> float:
    """Standard deviation of residuals about zero, from their median magnitude; NaN are left out."""
    # scipy.stats has it too, and takes 20 MB to import.
    known = residual[~np.isnan(residual)]
    return float(np.median(np.abs(known)) / ndtri(0.75)) if len(known) else math.nan


def autocorrelation(pieces: Sequence[Array], lags: int | None = None) -> Array:
    """Of residuals about zero, from lag 0 on; pairs do not reach from one piece into the next.

    The mean is not taken off: an offset that lasts a whole drive is the most correlated of all.

    Args:
        pieces: uninterrupted series, NaN where unknown, each (n,).
        lags: how many; None: as many as the longest piece has samples.
    """
    longest = max(len(piece) for piece in pieces)
    products = np.zeros(longest)
    for piece in pieces:
        known = np.where(np.isfinite(piece), piece, 0.0)
        size = 1 << (2 * len(known) - 1).bit_length()
        power = np.abs(np.fft.rfft(known, size)) ** 2
        products[: len(known)] += np.fft.irfft(power, size)[: len(known)]
    share = products / products[0] if products[0] > 0.0 else np.eye(1, longest)[0]
    return np.asarray(share[:lags])


def autocorrelation_time(
    pieces: Sequence[Array], lags: int | None = None, negligible: float | None = None
) -> float:
    """1 + 2 sum_k rho_k in samples: n correlated samples count as n over it.

    Args:
        pieces: uninterrupted series, NaN where unknown, each (n,).
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
