"""Nonlinear least squares with beliefs, and intervals that hold for autocorrelated residuals.

    minimise  sum_c 1 / (s_c^2 T_c) sum_n rho(r_nc)  +  sum_j ((theta_j - theta0_j) / spread_j)^2

r_nc is measured - modelled power of channel c (motors 1-3, whole robot), s_c its scale (median
absolute deviation) and T_c its integrated autocorrelation time in samples: n correlated samples
count as n / T_c, so that beliefs keep their weight. rho is quadratic up to a few s_c and linear
beyond, which keeps a bump or a knock from bending the result.
"""

from collections.abc import Callable

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tomr_power_model.calibration.intervals import Spread, pieces_of, spread_of
from tomr_power_model.calibration.loss import bent
from tomr_power_model.calibration.problem import Problem
from tomr_power_model.calibration.samples import CHANNELS
from tomr_power_model.estimation.statistics import autocorrelation_time, robust_scale

Array = NDArray[np.float64]

_ROUNDS = 3  # scales and correlation times settle in two
_LEAST_SCALE = 1e-3  # W; a simulation without noise must not make the weights infinite
_STEP = 1e-3  # of a belief's spread, for derivatives
_NUDGE = 0.1  # of a belief's spread
_TOLERANCE = 1e-6


@frozen
class Fit:
    """What a fit found."""

    numbers: Array  # fitted values, (p,)
    spread: Spread
    scale: Array  # of the residuals [W], (4,), NaN where nothing was measured
    evaluations: int
    converged: bool


def fit(problem: Problem, robust: bool = True, tick: Callable[[], None] = lambda: None) -> Fit:
    """Fit a problem's free values; `tick` is called at every evaluation of the model."""
    believed = np.array([item.believed for item in problem.free])
    width = np.array([item.spread for item in problem.free])
    lower = (np.array([item.lower for item in problem.free]) - believed) / width
    upper = (np.array([item.upper for item in problem.free]) - believed) / width
    count = 0
    # Off zero, where some effects have no slope.
    units = np.clip(np.where(believed == 0.0, _NUDGE, 0.0), lower, upper)
    residual = problem.residual(believed + width * units)
    solution = None
    for _ in range(_ROUNDS):
        scale, weight = _weights(problem, residual)

        def cost(trial: Array, scale: Array = scale, weight: Array = weight) -> Array:
            nonlocal count
            count += 1
            tick()
            rest = problem.residual(believed + width * trial)
            data = weight * bent(rest / scale, robust)
            return np.concatenate([data[np.isfinite(data)], trial])

        solution = least_squares(
            cost,
            np.clip(units, lower, upper),
            bounds=(lower, upper),
            xtol=_TOLERANCE,
            ftol=_TOLERANCE,
            diff_step=np.full(len(width), _STEP),
            x_scale=1.0,
        )
        units = solution.x
        residual = problem.residual(believed + width * units)
    assert solution is not None
    numbers = believed + width * units
    scale, weight = _weights(problem, residual)
    slope = problem.jacobian(numbers, _STEP * width, tick) * width
    spread = spread_of(problem, residual / scale, slope / scale[:, None], weight, robust)
    return Fit(numbers, spread, scale, count, bool(solution.success))


def _weights(problem: Problem, residual: Array) -> tuple[Array, Array]:
    """Scale of each channel's residuals [W], and the weight that its correlation leaves, (4,)."""
    scale, weight = np.full(CHANNELS, np.nan), np.full(CHANNELS, np.nan)
    for channel in range(CHANNELS):
        known = residual[np.isfinite(residual[:, channel]), channel]
        if len(known):
            scale[channel] = max(robust_scale(known), _LEAST_SCALE)
            series = residual[:, channel] / scale[channel]
            weight[channel] = (
                autocorrelation_time(pieces_of(problem.samples, bent(series, True))) ** -0.5
            )
    return scale, weight
