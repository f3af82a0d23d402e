"""MAP fit of a description to measured power, with intervals that hold for correlated residuals.

    minimise  sum_c 1 / (s_c^2 T_c) sum_n rho(r_nc)  +  sum_j ((theta_j - theta0_j) / std_j)^2

r_nc is measured - modelled power of channel c (motors 1-3, whole robot), s_c its scale (median
absolute deviation) and T_c its integrated autocorrelation time in samples: n correlated samples
count as n / T_c, so that priors keep their weight. rho is quadratic up to a few s_c and linear
beyond, which keeps a bump or a knock from bending the result.
"""

from collections.abc import Callable, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import Problem
from tomr_power_model.calibration.samples import CHANNELS
from tomr_power_model.estimation.gauss_newton import (
    GaussNewtonSettings,
    Linearisation,
    Start,
    maximise,
)
from tomr_power_model.estimation.intervals import Uncertainty, block_jackknife, uninterrupted
from tomr_power_model.estimation.parameter import bounds, prior_stds
from tomr_power_model.estimation.robust import soft_l1
from tomr_power_model.estimation.statistics import autocorrelation_time, robust_scale

Array = NDArray[np.float64]

_ROUNDS = 3  # scales and correlation times settle in two
_LEAST_SCALE = 1e-3  # W; a simulation without noise must not make the weights infinite
_STEP = 1e-3  # prior standard deviations, for derivatives
_NUDGE = 0.1  # prior standard deviations
_SETTINGS = GaussNewtonSettings(most_steps=50, settled=1e-6)


@frozen
class Fit:
    """What a fit found."""

    numbers: Array  # fitted values, (p,)
    uncertainty: Uncertainty
    scale: Array  # of the residuals [W], (4,), NaN where nothing was measured
    converged: bool


def fit(problem: Problem, robust: bool = True, tick: Callable[[], None] = lambda: None) -> Fit:
    """Fit a problem's parameters; `tick` is called at every evaluation of the model."""
    mean = np.array([item.prior_mean for item in problem.parameters])
    std = prior_stds(problem.parameters)
    least, most = bounds(problem.parameters)
    lower, upper = (least - mean) / std, (most - mean) / std

    def numbers_at(units: Array) -> Array:
        return np.clip(mean + std * units, least, most)  # rounding leads out of them

    # Off zero, where some effects have no slope.
    units = np.where(mean == 0.0, _NUDGE, 0.0)
    residual, converged = problem.residual(numbers_at(units)), False
    for _ in range(_ROUNDS):
        scale, weight = _weights(problem, residual)

        def evaluate(
            _: Sequence[int], points: Sequence[Array], scale: Array = scale, weight: Array = weight
        ) -> list[Linearisation]:
            numbers = numbers_at(points[0])
            root, change = soft_l1(problem.residual(numbers) / scale, robust)
            slope = problem.jacobian(numbers, _STEP * std, tick) * std
            known = np.isfinite(root)
            slope *= (weight * change / scale)[:, :, None]
            return [Linearisation.of((weight * root)[known], slope[known])]

        start = Start(units, lower, upper, np.full(len(std), np.inf))
        (found,) = maximise([start], evaluate, _SETTINGS)
        assert found.best is not None
        units, converged = found.best.units, not found.is_open
        residual = problem.residual(numbers_at(units))
    numbers = numbers_at(units)
    scale, weight = _weights(problem, residual)
    slope = problem.jacobian(numbers, _STEP * std, tick) * std
    uncertainty = block_jackknife(
        problem.samples, residual / scale, slope / scale[:, None], weight, robust=robust
    )
    return Fit(numbers, uncertainty, scale, converged)


def _weights(problem: Problem, residual: Array) -> tuple[Array, Array]:
    """Scale of each channel's residuals [W], and the weight that its correlation leaves, (4,)."""
    scale, weight = np.full(CHANNELS, np.nan), np.full(CHANNELS, np.nan)
    for channel in range(CHANNELS):
        known = residual[np.isfinite(residual[:, channel]), channel]
        if len(known):
            scale[channel] = max(robust_scale(known), _LEAST_SCALE)
            series = soft_l1(residual[:, channel] / scale[channel])[0]
            weight[channel] = autocorrelation_time(uninterrupted(problem.samples, series)) ** -0.5
    return scale, weight
