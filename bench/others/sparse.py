"""Sparse regression (PySINDy) on what the simulation leaves of each motor's power.

Ensemble SINDy: STLSQ on bootstrap samples, terms kept that the median model has. Columns and
residual are scaled to unit RMS; the threshold is the largest whose error in cross validation over
contiguous blocks is within one standard error of the least, which favours few terms.
"""

import importlib
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from others.case import Case, nrmse, powers, residuals
from others.library import columns_of, series_of
from tomr_power_model.errors import InputError

Array = NDArray[np.float64]

_THRESHOLDS = np.geomspace(0.01, 1.0, 13)
_BLOCKS = 5
_MODELS = 20
_SEED = 0
_REQUIREMENTS = Path(__file__).with_name("requirements.txt")


@frozen
class Equation:
    """What was found for one motor, or for the total."""

    channel: str
    wheel: int | None
    threshold: float
    terms: Mapping[str, float]  # coefficients by term, in units of the residual's RMS


@frozen
class Sparse:
    """All equations, and what they do to the held-out error."""

    equations: tuple[Equation, ...]
    after: float


def pysindy() -> Any:
    """The package. Raises InputError where it is missing."""
    try:
        return importlib.import_module("pysindy")
    except ImportError:
        raise InputError(
            f"pysindy is not installed: pip install -r {_REQUIREMENTS.resolve()}"
        ) from None


def regress(case: Case) -> Sparse:
    """Find equations on a case's recording and score them on its holdout."""
    robot = case.base.robot
    left = [residuals(item, item.predict([robot])[0]) for item in (case.real, case.held)]
    real, held = (series_of(item, robot) for item in (case.real, case.held))
    equations = []
    for number in powers(case.real.channels):
        channel = case.real.channels[number]
        columns = columns_of(case.real, real, channel)
        threshold, coefficients = sparse(columns, left[0][number])
        scale = np.sqrt(np.mean(columns**2, axis=0)) / np.sqrt(np.mean(left[0][number] ** 2))
        found = zip(real, coefficients, scale, strict=True)
        terms = {name: float(c * s) for name, c, s in found if c}
        equations.append(Equation(channel.name, channel.wheel, threshold, terms))
        for place, other in enumerate(case.held.channels):
            if other.name == channel.name:
                left[1][place] -= columns_of(case.held, held, other) @ coefficients
    return Sparse(tuple(equations), nrmse(case.held.channels, left[1]))


def sparse(columns: Array, target: Array) -> tuple[float, Array]:
    """(threshold, coefficients in units of the target): zero where a term is left out."""
    package = pysindy()
    scale = np.sqrt(np.mean(columns**2, axis=0))
    scale[scale == 0.0] = 1.0
    unit = float(np.sqrt(np.mean(target**2))) or 1.0
    scaled, wanted = columns / scale, target / unit
    threshold = _threshold(package, scaled, wanted)
    np.random.seed(_SEED)  # PySINDy draws its samples from the global generator
    ensemble = package.EnsembleOptimizer(
        package.STLSQ(threshold=threshold), bagging=True, n_models=_MODELS
    )
    return threshold, _fitted(ensemble, scaled, wanted) * unit / scale


def _threshold(package: Any, columns: Array, target: Array) -> float:
    blocks = np.array_split(np.arange(len(target)), _BLOCKS)
    errors = np.empty((len(_THRESHOLDS), _BLOCKS))
    for place, block in enumerate(blocks):
        rows = np.setdiff1d(np.arange(len(target)), block)
        for number, threshold in enumerate(_THRESHOLDS):
            found = _fitted(package.STLSQ(threshold=threshold), columns[rows], target[rows])
            errors[number, place] = np.mean((target[block] - columns[block] @ found) ** 2)
    mean = errors.mean(axis=1)
    best = int(np.argmin(mean))
    enough = mean[best] + errors[best].std(ddof=1) / np.sqrt(_BLOCKS)
    return float(_THRESHOLDS[mean <= enough].max())


def _fitted(optimizer: Any, columns: Array, target: Array) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a threshold leaves no term is an answer
        optimizer.fit(columns, target[:, None])
    return np.asarray(optimizer.coef_, dtype=np.float64).reshape(-1)
