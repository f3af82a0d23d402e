"""From a table to physics: short laws that fit the recordings as well as the table does.

A law is a function of the table's variables with a few parameters. It is fitted to the data through
the table's own normal equations: with u the units of its values at the knots, G and b as they are
for the table, the sum of squares changes by u^T G u - 2 u^T b.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.unmodelled import LearntTerm
from tomr_reality_gap.explanation import FittedLaw
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.rules import estimate_of

Array = NDArray[np.float64]

_AS_WELL = 0.9  # of what the table explains
_LISTED = 3
_TINY = 1e-9
_NOTHING = 1e-300  # variance of a parameter that the data do not tell
_NEGLIGIBLE = 1e-6  # of the largest eigenvalue
_POSITIVE = ("slack", "radius", "decay")
_WHOLE = ("order",)  # parameters that are whole numbers
_BEYOND = 1.0  # of the range, on either side, that a law is trusted beyond the table
SMOOTH = 0.25  # of the distance between knots, of a step
_FINER = {1: 4, 2: 2}  # knots of a law's table for each of the learnt one, by its axes


@frozen
class Law:
    """A short law: its parameters with units (`*` is the table's), starts, and values at places."""

    name: str
    words: str  # with the parameters by name
    families: tuple[str, ...]
    units: Mapping[str, str]
    starts: Callable[[Array, Array], Sequence[Sequence[float]]]  # places (k, axes), values (c, k)
    value: Callable[[Array, Array], Array]  # of parameters and places: (c, k) or (k,)
    # The same of one variable x as an effect's file has it; WIDTH: over which a step is smooth.
    formula: str = ""


def _apart(p: Array, at: Array) -> tuple[Array, Array]:
    away = p[-2:] - at
    return away, np.maximum(np.hypot(away[:, 0], away[:, 1]), _TINY)


def _spring(p: Array, at: Array) -> Array:
    away, distance = _apart(p, at)
    return np.asarray(p[0] * np.maximum(distance - abs(p[1]), 0.0) / distance * away.T)


def _spring_starts(at: Array, values: Array) -> list[list[float]]:
    """Anchors inside and around; the stiffness from the largest force over the largest distance."""
    middle, reach = at.mean(axis=0), np.ptp(at, axis=0)
    stiff = float(np.abs(values).max()) / max(float(reach.max()), _TINY)
    shifts = product((-0.3, 0.0, 0.3), repeat=2)
    return [[2 * stiff, 0.2 * float(reach.max()), *(middle + reach * s)] for s in shifts]


def _wind(p: Array, at: Array) -> Array:
    away, speed = _apart(p, at)
    return np.asarray(p[0] * speed * away.T)


def _wind_starts(at: Array, values: Array) -> list[list[float]]:
    fast = max(float(np.ptp(at, axis=0).max()), _TINY)
    size = float(np.abs(values).max()) / fast**2
    return [[size, x * fast, y * fast] for x, y in product((-1.0, -0.3, 0.3, 1.0), repeat=2)]


def _patch(p: Array, at: Array) -> Array:
    _, distance = _apart(p, at)
    edge = 0.25 * max(abs(p[1]), _TINY)
    return np.asarray(p[0] / (1.0 + np.exp(np.clip((distance - abs(p[1])) / edge, -50.0, 50.0))))


def _patch_starts(at: Array, values: Array) -> list[list[float]]:
    mean = values.mean(axis=0)
    best, reach = at[int(np.argmax(np.abs(mean)))], float(np.ptp(at, axis=0).max())
    return [[float(mean[np.argmax(np.abs(mean))]), part * reach, *best] for part in (0.1, 0.2, 0.4)]


def _extreme(values: Array) -> float:
    mean = values.mean(axis=0)
    return float(mean[int(np.argmax(np.abs(mean)))])


def _curve_starts(*shapes: float) -> Callable[[Array, Array], list[list[float]]]:
    """Size from the values, the shape from parts of the variable's range."""

    def starts(at: Array, values: Array) -> list[list[float]]:
        low, reach = float(at.min()), float(np.ptp(at))
        return [[_extreme(values), low + part * reach] for part in shapes]

    return starts


def _harmonic_starts(at: Array, values: Array) -> list[list[float]]:
    size = float(np.abs(values).max())
    return [[size, float(n), q] for n, q in product(range(1, 13), (0.0, 2.0, 4.0))]


_SPEEDS = ("torque.speed", "driver.speed", "driver.current", "torque.current", "supply.current")
_MEMORY = ("torque.since_stand", "torque.turned", "torque.time")
_STEP = "/ (1.0 + math.exp(min((threshold - x) / WIDTH, 50.0)))"
_X, _Y = {"x": "m", "y": "m"}, {"x": "m/s", "y": "m/s"}
LAWS: tuple[Law, ...] = (
    Law(
        "spring",
        "pulled to a point at ({x}, {y}) from the start with {stiffness} beyond {slack}",
        ("force.place",),
        {"stiffness": "N/m", "slack": "m", **_X},
        _spring_starts,
        _spring,
    ),
    Law(
        "wind",
        "pushed as by a wind of ({x}, {y}) in the world, {coefficient} times the square",
        ("force.velocity",),
        {"coefficient": "N s^2/m^2", **_Y},
        _wind_starts,
        _wind,
    ),
    Law(
        "steady force",
        "pushed with ({x}, {y}) in the world, everywhere",
        ("force.place", "force.velocity"),
        {"x": "N", "y": "N"},
        lambda at, values: [values.mean(axis=1).tolist()],
        lambda p, at: np.repeat(p[:, None], len(at), axis=1),
    ),
    Law(
        "patch",
        "resists with {size} within {radius} of ({x}, {y}) from the start",
        ("torque.place",),
        {"size": "*", "radius": "m", **_X},
        _patch_starts,
        _patch,
    ),
    Law(
        "power law",
        "{size} times the variable to the power of {exponent}",
        _SPEEDS,
        {"size": "*", "exponent": ""},
        lambda at, values: [[_extreme(values) / at.max() ** n, n] for n in (0.5, 1.0, 2.0, 3.0)],
        lambda p, at: p[0] * np.maximum(at[:, 0], _TINY) ** np.clip(p[1], 0.0, 6.0),
        "size * x**exponent",
    ),
    Law(
        "square beyond a threshold",
        "{size} times the square of the variable beyond {threshold}",
        _SPEEDS,
        {"size": "*", "threshold": "variable"},
        lambda at, values: [
            [_extreme(values) / at.max() ** 2, part * at.max()] for part in (0.1, 0.3, 0.5, 0.7)
        ],
        lambda p, at: p[0] * at[:, 0] ** 2 * _above(at[:, 0], p[1]),
        f"size * x * x {_STEP}",
    ),
    Law(
        "step",
        "{size} beyond {threshold}",
        (*_SPEEDS, *_MEMORY),
        {"size": "*", "threshold": "variable"},
        _curve_starts(0.1, 0.3, 0.5, 0.7),
        lambda p, at: p[0] * _above(at[:, 0], p[1]),
        f"size {_STEP}",
    ),
    Law(
        "exponential",
        "{size} that dies out over {decay}",
        (*_MEMORY, *_SPEEDS),
        {"size": "*", "decay": "variable"},
        _curve_starts(0.05, 0.15, 0.4),
        lambda p, at: p[0] * np.exp(-np.minimum(at[:, 0] / max(abs(p[1]), _TINY), 50.0)),
        "size * math.exp(-min(x / decay, 50.0))",
    ),
    Law(
        "periodic",
        "{size} that comes {order} times a turn, at {phase}",
        ("torque.angle", "torque.direction", "torque.heading"),
        {"size": "*", "order": "1/rev", "phase": "rad"},
        _harmonic_starts,
        lambda p, at: p[0] * np.sin(round(p[1]) * at[:, 0] + p[2]),
        "size * math.sin(order * x + phase)",
    ),
)


def _above(values: Array, threshold: float) -> Array:
    """A step as smooth as the table."""
    width = SMOOTH * float(np.min(np.diff(np.unique(values)))) + _TINY
    return np.asarray(1.0 / (1.0 + np.exp(np.clip((threshold - values) / width, -50.0, 50.0))))


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
        finer = _FINER[len(self.table.knots)]
        knots = tuple(_farther(points, finer, axis.is_periodic) for points, axis in pairs)
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


def laws_of(table: Table, learnt: LearntTerm, evidence: Evidence) -> list[LawAt]:
    """Laws that explain about as much as the table, simplest first."""
    known = [law for law in LAWS if table.family.family_id in law.families]
    found = [item for law in known if (item := _fitted(law, table, learnt, evidence)) is not None]
    found = [item for item in found if item.share > _AS_WELL]
    found.sort(key=lambda item: len(item.parameters) - 20.0 * item.share)
    return found[:_LISTED]


def _explained(units: Array, evidence: Evidence) -> float:
    return float(2.0 * units @ evidence.vector - units @ evidence.matrix @ units)


def _fitted(law: Law, table: Table, learnt: LearntTerm, evidence: Evidence) -> LawAt | None:
    at, count = _places(table.knots), len(learnt.values)
    values, vectors = np.linalg.eigh(evidence.matrix)
    kept = values > _NEGLIGIBLE * values.max()
    root = np.sqrt(values[kept])
    target = (vectors[:, kept].T @ evidence.vector) / root
    inverse = np.linalg.inv(table.root)

    def units_at(p: Array) -> Array:
        rows = np.broadcast_to(np.atleast_2d(law.value(p, at)), (count, len(at)))
        return np.asarray((rows @ inverse.T).ravel())

    def misfit(p: Array) -> Array:
        return np.asarray(root * (vectors[:, kept].T @ units_at(p)) - target)

    tried = [
        least_squares(misfit, start, x_scale=np.abs(start) + 0.1, max_nfev=60)
        for start in law.starts(at, learnt.values)
    ]
    if not tried:
        return None
    best = min(tried, key=lambda item: float(item.cost))
    p = np.asarray(best.x, dtype=np.float64)
    # Only the whole part of these counts, so that nothing kept the fit from drifting within it.
    p = np.where([name in _WHOLE for name in law.units], np.round(p), p)
    whole = _explained((learnt.values @ inverse.T).ravel(), evidence)
    share = _explained(units_at(p), evidence) / max(whole, _TINY)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * evidence.inflation
    return LawAt(law, p, covariance, share, table, learnt)


def _places(knots: Sequence[Array]) -> Array:
    return np.array(list(product(*knots)), dtype=np.float64)


def _farther(points: Array, finer: int, is_periodic: bool) -> Array:
    if is_periodic:
        return points
    low, high = float(points[0]), float(points[-1])
    beyond, step = _BEYOND * (high - low), (points[1] - points[0]) / finer
    first = low if low >= 0.0 and low < step else low - beyond
    return np.asarray(first + step * np.arange(math.ceil((high + beyond - first) / step) + 1))


def words_of(law: FittedLaw) -> str:
    """The law with its numbers, for a person."""
    numbers = {
        name: f"{item.value:.3g} {item.unit}".rstrip() for name, item in law.parameters.items()
    }
    return law.words.format(**numbers)
