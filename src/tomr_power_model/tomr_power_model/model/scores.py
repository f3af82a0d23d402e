"""How well a model does, everywhere measured alike: over whole drives, transients included."""

import numpy as np
from numpy.typing import ArrayLike


def accuracy(measured: ArrayLike, modelled: ArrayLike) -> float:
    """1 - sum|P - P_model| / sum|P| over the instants where both are known.

    NaN without any, or where nothing was drawn.
    """
    power, error = _known(measured, modelled)
    drawn = float(np.abs(power).sum())
    return 1.0 - float(np.abs(error).sum()) / drawn if drawn else float("nan")


def nrmse(measured: ArrayLike, modelled: ArrayLike) -> float:
    """RMS of measured - modelled over the standard deviation of measured; NaN if that is zero."""
    power, error = _known(measured, modelled)
    spread = float(power.std()) if power.size else 0.0
    return float(np.sqrt(np.mean(error**2))) / spread if spread else float("nan")


def _known(measured: ArrayLike, modelled: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    power, model = np.asarray(measured, np.float64), np.asarray(modelled, np.float64)
    known = np.isfinite(power) & np.isfinite(model)
    return power[known], power[known] - model[known]
