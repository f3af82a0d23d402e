"""What no named effect explains: which variable it depends on, at which wheels, in what shape."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.explanation import Shape
from tomr_reality_gap.fit.linear import Gram, Matrix, Solution, solve
from tomr_reality_gap.fit.probed import Probed
from tomr_reality_gap.fit.refine import Fitted
from tomr_reality_gap.fit.search import Found
from tomr_reality_gap.fit.study import Columns, Study
from tomr_reality_gap.hypotheses.knobs import Hypothesis
from tomr_reality_gap.mismatch.probes import Family, Motion

Array = NDArray[np.float64]

_POINTS = 80
_NEEDED = 10.0  # log evidence that a named finding must bring beside an unnamed one
# Effects that are one curve of one variable.
_SHAPED = MappingProxyType({"drivetrain.torque_ripple": "wheel angle [rad]"})
_NEEDED_SHARE = 0.3  # or this part of what the unnamed one brings


@frozen
class Leftover:
    """The family of torques that explains most of what is left."""

    family: Family
    evidence: float  # log, against nothing but the named model, of all wheels that have it
    wheels: tuple[int, ...]
    by_wheel: tuple[float, ...]
    columns: Array  # of its bumps at those wheels, weighted (n, k)
    shapes: tuple[Shape, ...]
    turns: tuple[Array, ...]  # of the bumps at each of those wheels [N m], (k,) each

    def torque(self, motion: Motion) -> Array:
        """What it amounts to on a drive, at each wheel [N m], (n, 3)."""
        found = np.zeros_like(motion.speed)
        bumps = self.family.torques(motion)
        for wheel, turns in zip(self.wheels, self.turns, strict=True):
            found[:, wheel] = turns @ bumps[:, :, wheel]
        return found


def leftovers(
    study: Study, fitted: Fitted, columns: Columns, found: Found, nameless: Probed
) -> list[Leftover]:
    """Each family with its evidence, best first."""
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    weight = found.noise.weight
    base = _Base.of(columns.matrix[:, :kept], study.value - fitted.value, weight)
    results = [
        _result(study, family, nameless, base, response)
        for family, response in zip(nameless.families, nameless.responses, strict=True)
    ]
    return sorted(results, key=lambda item: -item.evidence)


def without_needless(
    study: Study,
    value: Array,
    columns: Columns,
    needed: Sequence[bool],
    found: Found,
    nameless: Probed,
    leftover: Leftover,
) -> Leftover:
    """The leftover of a model that lacks the findings it made needless; `value` as simulated."""
    weight = found.noise.weight
    rows = list(range(columns.instruments.stop))
    for part, wanted in zip(columns.own, needed, strict=True):
        rows += range(part.start, part.stop) if wanted else ()
    base = _Base.of(columns.matrix[:, rows], study.value - value, weight)
    places = [family.variable for family in nameless.families]
    response = nameless.responses[places.index(leftover.family.variable)]
    return _result(study, leftover.family, nameless, base, response)


@frozen
class _Base:
    """Whitened columns of the named model, and their normal equations."""

    columns: Array  # (n, p)
    residual: Array  # (n,)
    weight: Array  # (n,)
    gram: Gram

    @classmethod
    def of(cls, columns: Matrix, residual: Array, weight: Array) -> "_Base":
        whitened = columns * weight[:, None], residual * weight
        return cls(*whitened, weight, Gram.of(*whitened))

    @property
    def count(self) -> int:
        return len(self.gram.vector)

    def solved(self, parts: Sequence[Array]) -> Solution:
        """With further whitened columns, (n, k) each; next to nothing but zeros in each of them."""
        more = np.concatenate([*parts, np.empty((len(self.residual), 0))], axis=1)
        shown = np.flatnonzero(more.any(axis=1))
        own, cross = more[shown].T @ more[shown], self.columns[shown].T @ more[shown]
        gram = Gram(
            np.block([[self.gram.matrix, cross], [cross.T, own]]),
            np.concatenate([self.gram.vector, more[shown].T @ self.residual[shown]]),
            self.gram.square,
        )
        return solve(gram, range(len(gram.vector)))


def _result(
    study: Study, family: Family, nameless: Probed, base: _Base, response: Array
) -> Leftover:
    parts = [_only(response * base.weight[:, None], rows) for rows in nameless.rows]
    alone = base.solved(()).evidence
    gains = [base.solved((part,)).evidence - alone for part in parts]
    most = max(gains)
    wheels = tuple(wheel for wheel in range(WHEELS) if gains[wheel] > max(0.2 * most, 10.0))
    if not wheels:
        wheels = (int(np.argmax(gains)),)
    chosen = [parts[wheel] for wheel in wheels]
    whole = base.solved(chosen)
    shapes, turns = [], []
    for place, wheel in enumerate(wheels):
        rows = base.count + place * response.shape[1] + np.arange(response.shape[1])
        turns.append(nameless.size * whole.mean[rows])
        shapes.append(
            _shape(study, family, nameless.size, wheel, whole.mean[rows], whole.covariance, rows)
        )
    return Leftover(
        family,
        whole.evidence - alone,
        wheels,
        tuple(gains),
        np.concatenate(chosen, axis=1),
        tuple(shapes),
        tuple(turns),
    )


def _only(columns: Array, rows: NDArray[np.intp]) -> Array:
    kept = np.zeros_like(columns)
    kept[rows] = columns[rows]
    return kept


def _shape(
    study: Study,
    family: Family,
    size: float,
    wheel: int,
    mean: Array,
    covariance: Array,
    rows: Array,
) -> Shape:
    names = study.simulations[0].robot.wheel_names
    if family.is_periodic:
        at = np.linspace(0.0, 2.0 * np.pi, _POINTS)
    else:
        at = np.linspace(family.knots[0], family.knots[-1], _POINTS)
    basis = family.at(at).T
    part = covariance[np.ix_(rows, rows)]
    curve = size * basis @ mean
    half = 1.96 * size * np.sqrt(np.einsum("ij,jk,ik->i", basis, part, basis))
    return Shape(family.variable, names[wheel], at, curve, curve - half, curve + half)


def still_needed(
    study: Study,
    fitted: Fitted,
    columns: Columns,
    found: Found,
    leftover: Leftover,
    simulated: Sequence[Array],
) -> list[bool]:
    """Whether each named finding is needed once the leftover's torques are there.

    Args:
        study: the recordings.
        fitted: the model with all findings.
        columns: derivatives at it.
        found: what the search came to.
        leftover: the effect without a name.
        simulated: values of the model, and of the model without each of its findings.
    """
    weight = found.noise.weight
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    base = columns.matrix[:, :kept] * weight[:, None]
    residual = (study.value - fitted.value) * weight
    both = np.concatenate([base, leftover.columns], axis=1)
    everything = list(range(both.shape[1]))
    gram = Gram.of(both, residual)
    whole = _likelihood(gram, everything)
    least = max(_NEEDED, _NEEDED_SHARE * leftover.evidence)
    needed = []
    for part, without in zip(columns.own, simulated[1:], strict=True):
        rest = [row for row in everything if not part.start <= row < part.stop]
        lacking = residual + (simulated[0] - without) * weight
        other = Gram(gram.matrix, both.T @ lacking, float(lacking @ lacking))
        needed.append(whole - _likelihood(other, rest) > least)
    return [
        wanted and not _contradicts(leftover, hypothesis, study.simulations[0].robot)
        for wanted, hypothesis in zip(needed, fitted.model.hypotheses, strict=True)
    ]


def _contradicts(leftover: Leftover, hypothesis: Hypothesis, robot: Robot) -> bool:
    """Whether what is left is of the same variable and wheel: then it is not of the named shape."""
    if _SHAPED.get(hypothesis.effect) != leftover.family.variable:
        return False
    wheels = {robot.wheel_names[wheel] for wheel in leftover.wheels}
    return bool(wheels & set(hypothesis.where)) or "all_wheels" in hypothesis.where


def _likelihood(gram: Gram, chosen: Sequence[int]) -> float:
    """Log evidence of some columns, up to what all residuals of one weighting share."""
    return solve(gram, chosen).evidence - 0.5 * gram.square


def names(wheels: Sequence[int], robot: Robot) -> tuple[str, ...]:
    """Wheels as a report names them."""
    return ("all_wheels",) if len(wheels) == WHEELS else tuple(robot.wheel_names[w] for w in wheels)
