"""Maximum a posteriori (MAP) by Gauss-Newton, of many problems side by side.

Unknowns u are offsets from their prior means in units of their prior standard deviations. With
whitened residuals r(u) = (measured - predicted) / sigma and A = -dr/du:

    log posterior  log p = -1/2 |r|^2 - 1/2 |u|^2,    step (I + A^T A)^-1 (A^T r - u)
    log evidence (Laplace)  log p - 1/2 log|I + A^T A|,    covariance (I + A^T A)^-1

A step that makes things worse is taken back and a part of it tried; an unknown at a bound that the
gradient pushes against is held there.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from attrs import define, field, frozen
from numpy.typing import NDArray
from scipy.linalg import cho_solve

from tomr_power_model.estimation.factor import posterior_factor

Array = NDArray[np.float64]


@frozen(kw_only=True)
class GaussNewtonSettings:
    """When to go on and when to stop; gains are in log posterior."""

    most_steps: int = 6
    settled: float = 0.5  # gain that a further step would bring
    back: float = 0.3  # of a step that made things worse
    hopeless: float = 100.0  # evidence behind the best problem, after the step that is expected


@frozen
class Start:
    """Where a problem starts and how far it may go, all (p,)."""

    units: Array
    lower: Array
    upper: Array
    largest_step: Array  # that derivatives are good for


@frozen
class Linearisation:
    """A problem at one point: its residuals and the normal equations of the data."""

    residual: Array  # whitened, (n,)
    information: Array  # A^T A, (p, p)
    gradient: Array  # A^T r, (p,)

    @classmethod
    def of(cls, residual: Array, jacobian: Array) -> "Linearisation":
        """From the derivatives A of the whitened prediction by the unknowns, (n, p)."""
        return cls(residual, jacobian.T @ jacobian, jacobian.T @ residual)


@frozen
class MapEstimate:
    """The best point of a problem."""

    units: Array  # (p,)
    residual: Array  # whitened, (n,)
    gradient: Array  # of the log posterior, (p,)
    factor: tuple[Array, bool]  # Cholesky factor of the information I + A^T A

    @classmethod
    def at(cls, units: Array, point: Linearisation) -> "MapEstimate":
        """From the normal equations at a point."""
        factor = posterior_factor(point.information)
        return cls(units, point.residual, point.gradient - units, factor)

    @property
    def chi2(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residual @ self.residual)

    @property
    def log_posterior(self) -> float:
        """Up to a constant."""
        return -0.5 * self.chi2 - 0.5 * float(self.units @ self.units)

    @property
    def log_evidence(self) -> float:
        """After Laplace, up to a constant that problems of one set of data share."""
        return self.log_posterior - float(np.log(np.diag(self.factor[0])).sum())

    @property
    def covariance(self) -> Array:
        """Of the unknowns [prior standard deviations], (p, p)."""
        return np.asarray(cho_solve(self.factor, np.eye(len(self.units))))

    def step(self, lower: Array, upper: Array) -> Array:
        """The Gauss-Newton step of what is not held at a bound, (p,)."""
        outward = np.where(self.gradient > 0.0, self.units >= upper, self.units <= lower)
        if not outward.any():
            return np.asarray(cho_solve(self.factor, self.gradient))
        free, found = np.flatnonzero(~outward), np.zeros_like(self.units)
        root = np.tril(self.factor[0])
        information = root[free] @ root[free].T
        found[free] = np.linalg.solve(information, self.gradient[free])
        return found


@define
class GaussNewton:
    """One problem's way to its maximum: evaluate `position`, then `tell` what was found there."""

    start: Start
    settings: GaussNewtonSettings
    position: Array = field(init=False)
    is_open: bool = True
    expected: float = math.inf  # gain of the next step
    best: MapEstimate | None = None
    _step: Array = field(init=False)

    def __attrs_post_init__(self) -> None:
        self.position = np.clip(self.start.units, self.start.lower, self.start.upper)

    @property
    def log_evidence(self) -> float:
        """Of the best point so far."""
        return -math.inf if self.best is None else self.best.log_evidence

    def tell(self, point: Linearisation) -> None:
        """Take note of what the position is worth and choose the next."""
        at, start = MapEstimate.at(self.position, point), self.start
        if self.best is None or at.log_posterior > self.best.log_posterior:
            self.best = at
            step = at.step(start.lower, start.upper)
            self.expected = 0.5 * float(at.gradient @ step)
            self._step = np.clip(step, -start.largest_step, start.largest_step)
        else:
            self._step = self.settings.back * self._step
            self.expected *= self.settings.back
        self.is_open = self.expected > self.settings.settled
        self.position = np.clip(self.best.units + self._step, start.lower, start.upper)


def maximise(
    starts: Sequence[Start],
    evaluate: Callable[[Sequence[int], Sequence[Array]], Sequence[Linearisation]],
    settings: GaussNewtonSettings = GaussNewtonSettings(),
) -> list[GaussNewton]:
    """Each problem brought to its maximum; those left hopelessly behind by others are not.

    Args:
        starts: one for each problem.
        evaluate: linearises problems, given by their numbers, each at a point; all in one call.
        settings: when to stop.
    """
    problems = [GaussNewton(start, settings) for start in starts]
    for _ in range(settings.most_steps):
        numbers = [number for number, problem in enumerate(problems) if problem.is_open]
        if not numbers:
            break
        points = evaluate(numbers, [problems[number].position for number in numbers])
        for number, point in zip(numbers, points, strict=True):
            problems[number].tell(point)
        best = max(problem.log_evidence for problem in problems)
        for problem in problems:
            if problem.log_evidence + problem.expected < best - settings.hopeless:
                problem.is_open = False
    return problems
