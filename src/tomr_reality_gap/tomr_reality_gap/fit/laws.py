"""From a table to physics: short laws that fit the recordings as well as the table does.

A law is a function of the table's variables with a few parameters. It is fitted to the data through
the table's own normal equations: with u the units of its values at the knots, G and b as they are
for the table, the sum of squares changes by u^T G u - 2 u^T b.
"""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.unmodelled import LearntTerm
from tomr_reality_gap.explanation import FittedLaw
from tomr_reality_gap.fit.law_forms import LAWS, SIZES, TINY, Law
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.rules import estimate_of

Array = NDArray[np.float64]

AS_WELL = 0.9  # of what the table explains
_LISTED = 3
_COST = 10.0  # log evidence that a parameter must bring
_NOTHING = 1e-300  # variance of a parameter that the data do not determine
_NEGLIGIBLE = 1e-6  # of the largest eigenvalue
_POSITIVE = ("slack", "radius", "decay", "width")
_THRESHOLD = "threshold"
_WHOLE = ("order",)  # parameters that are whole numbers
_BEYOND = 1.0  # of the range, on either side, that a law is trusted beyond the table
_FINER = {1: 4, 2: 2}  # knots of a law's table for each of the learnt one, by its axes
_FLOOR = (4, 0.25)  # the same of a map of the floor, and how far it is trusted beyond it
_STARTS = 12  # of a fit, at most


@frozen
class Evidence:
    """Normal equations of a table's units, all else eliminated."""

    matrix: Array  # G, (c k, c k)
    vector: Array  # b, (c k,)
    inflation: float  # variance of what is left, correlation included, over that of the noise


@frozen
class LawAt:
    """A law with its parameters."""

    law: Law
    parameters: Array
    covariance: Array  # of the parameters, (p, p)
    share: float  # of what the table explains
    table: Table
    learnt: LearntTerm

    @property
    def term(self) -> LearntTerm:
        """The law as a table that reaches farther than what was learnt, and is finer."""
        pairs = zip(self.table.knots, self.table.family.axes, strict=True)
        is_floor = self.table.family.is_shared
        finer, beyond = _FLOOR if is_floor else (_FINER[len(self.table.knots)], _BEYOND)
        knots = tuple(
            points if axis.is_periodic else _farther(points, finer, beyond)
            for points, axis in pairs
        )
        at, learnt = _places(knots), self.learnt
        values = np.atleast_2d(self.law.value(self.parameters, at))
        rows = np.broadcast_to(values, (len(learnt.values), len(at)))
        return LearntTerm(learnt.family, learnt.wheels, knots, np.array(rows))

    @property
    def fitted(self) -> FittedLaw:
        """As a report has it."""
        estimates = {}
        for (name, unit), value, sigma in zip(
            self.law.units.items(), self.parameters.tolist(), self._sigma.tolist(), strict=True
        ):
            value, least = (abs(value), 0.0) if name in _POSITIVE else (value, -math.inf)
            unit = unit_of(unit, self.learnt)
            bounds = (least, math.inf)
            estimates[name] = estimate_of(value, sigma, offset=value, unit=unit, bounds=bounds)
        return FittedLaw(self.law.name, self.law.words, estimates, self.share)

    @property
    def is_within(self) -> bool:
        """Whether what it sets in at was met; a threshold beyond is another law in disguise."""
        at = dict(zip(self.law.units, self.parameters.tolist(), strict=True)).get(_THRESHOLD)
        points = self.table.knots[0]
        return at is None or float(points[0]) <= at <= float(points[-1])

    @property
    def _sigma(self) -> Array:
        """Standard deviations of the parameters but for what is never known of each itself.

        What is never known of one moves the others as the data tie them to it: the size of a power
        law, its value at 1, is far from where it was driven.
        """
        variance = np.diag(self.covariance)
        never = SIMULATOR.parameter * self.parameters
        moved = self.covariance * (never / np.maximum(variance, _NOTHING))
        np.fill_diagonal(moved, 0.0)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) + (moved**2).sum(axis=1)))


def unit_of(unit: str, term: LearntTerm) -> str:
    """Of a law's parameter, from what it is in `Law.units`."""
    return {"*": term.unit, "variable": term.family.axes[0].unit}.get(unit, unit)


def laws_of(
    table: Table, learnt: LearntTerm, evidence: Evidence, least: float = AS_WELL
) -> list[LawAt]:
    """Laws that explain `least` of what the table does at least, simplest first."""
    misfit = _Misfit.of(table, evidence)
    known = [law for law in LAWS.values() if table.family.family_id in law.families]
    found = [_fitted(law, table, learnt, misfit) for law in known]
    found = [item for item in found if item.share > least and item.is_within]
    whole = 0.5 * misfit.explained(learnt.values) / evidence.inflation
    found.sort(key=lambda item: _COST * len(item.parameters) - whole * item.share)
    return found[:_LISTED]


@frozen
class _Misfit:
    """Of values at a table's knots, in standard deviations; of m that the recordings determine."""

    matrix: Array  # of the values of all rows, (m, c k)
    target: Array  # (m,)
    inflation: float  # see `Evidence`

    @classmethod
    def of(cls, table: Table, evidence: Evidence) -> "_Misfit":
        values, vectors = np.linalg.eigh(evidence.matrix)
        kept = values > _NEGLIGIBLE * values.max()
        root = np.sqrt(values[kept])
        units = vectors[:, kept].T.reshape(len(root), -1, table.root.shape[1])
        matrix = root[:, None, None] * (units @ np.linalg.pinv(table.root))
        target = (vectors[:, kept].T @ evidence.vector) / root
        return cls(matrix.reshape(len(root), -1), target, evidence.inflation)

    def shown(self, values: Array) -> Array:
        """What values (..., c k) show, (..., m)."""
        return np.asarray(values @ self.matrix.T)

    def explained(self, values: Array) -> float:
        """By how much values (c, k) lessen the sum of squares."""
        shown = self.shown(values.ravel())
        return float(2.0 * shown @ self.target - shown @ shown)


def _fitted(law: Law, table: Table, learnt: LearntTerm, misfit: _Misfit) -> LawAt:
    at, count = _places(table.knots), len(learnt.values)

    def values_at(p: Array) -> Array:
        return np.broadcast_to(np.atleast_2d(law.value(p, at)), (count, len(at))).ravel()

    starts = np.array(law.starts(at, learnt.values), dtype=np.float64)
    shown = misfit.shown(np.stack([values_at(start) for start in starts]))
    if next(iter(law.units)) in SIZES:
        size = shown @ misfit.target / np.maximum((shown**2).sum(axis=1), TINY)
        starts[:, 0] *= size
        shown *= size[:, None]
    left = ((shown - misfit.target) ** 2).sum(axis=1)
    tried = [
        least_squares(
            lambda p: misfit.shown(values_at(p)) - misfit.target,
            start,
            x_scale=np.abs(start) + 0.1,
            max_nfev=60,
        )
        for start in starts[np.argsort(left, kind="stable")[:_STARTS]]
    ]
    best = min(tried, key=lambda item: float(item.cost))
    p = np.asarray(best.x, dtype=np.float64)
    # Only the whole part of these counts, so that nothing kept the fit from drifting within it.
    p = np.where([name in _WHOLE for name in law.units], np.round(p), p)
    whole = max(misfit.explained(learnt.values), TINY)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * misfit.inflation
    return LawAt(law, p, covariance, misfit.explained(values_at(p)) / whole, table, learnt)


def _places(knots: Sequence[Array]) -> Array:
    return np.array(list(product(*knots)), dtype=np.float64)


def _farther(points: Array, finer: int, share: float) -> Array:
    low, high = float(points[0]), float(points[-1])
    beyond, step = share * (high - low), (points[1] - points[0]) / finer
    first = low if low >= 0.0 and low < step else low - beyond
    return np.asarray(first + step * np.arange(math.ceil((high + beyond - first) / step) + 1))


def words_of(law: FittedLaw) -> str:
    """The law with its numbers, for a person."""
    numbers = {
        name: f"{item.value:.3g} {item.unit}".rstrip() for name, item in law.parameters.items()
    }
    return law.words.format(**numbers)
