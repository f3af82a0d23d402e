"""Fit of the creep to legs: each wheel its own where one floor is known, one for all where several.

What floors have in common is less than what one has to itself: the details fitted to some spoil the
others, so several floors share one coefficient, and how far each floor's own lies from it is its
uncertainty on a floor not seen.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tomr_odometry.creep import Creep
from tomr_odometry.learn.drives import Leg
from tomr_power_model.slides.body import ContactBody

Array = NDArray[np.float64]
_NOISE = 0.03  # of the way: what a leg's end is off besides
_YAW = 0.15  # m/rad: how much the heading at the end counts
_PRIOR = 0.5  # standard deviation of a coefficient before the drives, and of the growth
_START = 0.5
_ROUNDS = 12  # of the fixed point for the speed of travel


class Batch:
    """Legs of equal length, the shorter ones filled up with rest."""

    def __init__(self, legs: Sequence[Leg], body: ContactBody) -> None:
        longest = max(len(leg.steps) for leg in legs)
        self.steps, self.used = np.zeros((2, len(legs), longest, 3))
        for place, leg in enumerate(legs):
            self.steps[place, : len(leg.steps)] = leg.steps
            self.used[place, : len(leg.used)] = leg.used
        self.moved = np.array([leg.moved for leg in legs])
        self.way = np.array([leg.way for leg in legs])
        self._to_twist = body.to_twist.T

    def ends(self, coefficient: Array, growth: float) -> Array:
        """Where the legs end by the wheels less their creep: x, y [m], yaw [rad], (n, 3)."""
        creeps = (coefficient * self.used * (1.0 + growth * self.used**2)) @ self._to_twist
        rolled = self.steps @ self._to_twist
        by_wheels = np.hypot(rolled[..., 0], rolled[..., 1])
        travel = by_wheels.copy()
        for _ in range(_ROUNDS):
            step = rolled - creeps * travel[..., None]
            travel = 0.5 * (travel + np.minimum(np.hypot(step[..., 0], step[..., 1]), by_wheels))
        step = rolled - creeps * travel[..., None]
        yaw = np.cumsum(step[..., 2], axis=1) - 0.5 * step[..., 2]
        x = (np.cos(yaw) * step[..., 0] - np.sin(yaw) * step[..., 1]).sum(axis=1)
        y = (np.sin(yaw) * step[..., 0] + np.cos(yaw) * step[..., 1]).sum(axis=1)
        return np.stack([x, y, step[..., 2].sum(axis=1)], axis=1)

    def errors(self, coefficient: Array, growth: float) -> Array:
        """Distance of the ends from the true ones [m]."""
        off = self.ends(coefficient, growth) - self.moved
        return np.asarray(np.hypot(off[:, 0], off[:, 1]))


def _solve(batches: Sequence[Batch], start: Array, spread: Callable[[Array], Array]) -> Array:
    """Least squares over floors that weigh alike; `spread` takes parameters to c (3) and growth."""

    def residuals(given: Array) -> Array:
        parts = [(given - start) / _PRIOR]
        for batch in batches:
            numbers = spread(given)
            off = batch.ends(numbers[:3], numbers[3]) - batch.moved
            plain = float(np.median(batch.errors(np.zeros(3), 0.0)))
            scale = max(0.1 * plain, _NOISE * float(np.median(batch.way))) * np.sqrt(len(off) / 30)
            parts += [(off[:, :2] / scale).ravel(), _YAW * off[:, 2] / scale]
        return np.concatenate(parts)

    found = least_squares(residuals, start, loss="soft_l1", diff_step=1e-3, max_nfev=30)
    return np.asarray(found.x)


def _one(given: Array) -> Array:
    return np.array([given[0], given[0], given[0], 0.0])


def fit_creep(floors: Mapping[str, Sequence[Leg]], body: ContactBody) -> Creep:
    """The creep of one floor in its details, or what several have in common."""
    batches = [Batch(legs, body) for legs in floors.values()]
    if len(batches) == 1:
        found = _solve(batches, np.array([_START, _START, _START, 0.0]), np.asarray)
        found[:3] = np.maximum(found[:3], 0.0)
        numbers = np.concatenate([found[:3], [float(np.clip(found[3], -2.0, 10.0))]])
        left = batches[0].errors(numbers[:3], float(numbers[3]))
        plain = batches[0].errors(np.zeros(3), 0.0)
        doubt = float(np.median(left) / max(float(np.median(plain)), 1e-6))
        mean = float(numbers[:3].mean())
        first, second, third = numbers[:3].tolist()
        return Creep((first, second, third), float(numbers[3]), min(doubt, 1.0) * mean)
    common = max(float(_solve(batches, np.array([_START]), _one)[0]), 0.0)
    own = [float(_solve([batch], np.array([_START]), _one)[0]) for batch in batches]
    uncertainty = float(np.sqrt(np.mean(np.square(np.array(own) - common))))
    return Creep((common, common, common), 0.0, uncertainty)
