"""What no named effect explains: which variable it depends on, at which wheels, in what shape."""

from collections.abc import Collection, Sequence
from types import MappingProxyType

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.estimation.linear_gaussian import Gram, Solution, solve
from tomr_power_model.estimation.noise import Noise
from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.explanation import Shape
from tomr_reality_gap.fit.basis_responses import BasisResponses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.jacobian import Jacobian
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.mismatch.probes import Family, Motion

Array = NDArray[np.float64]

_POINTS = 80
_NEEDED = 10.0  # log evidence that a named finding must bring beside an unnamed one, and a wheel
_WHEEL_SHARE = 0.2  # of the log evidence of the wheel that shows most
# Effects that are one curve of one variable.
_SHAPED = MappingProxyType({"drivetrain.torque_ripple": "wheel angle [rad]"})


@frozen
class Remainder:
    """What a model leaves of the recordings, whitened."""

    dataset: Dataset
    residual: Array  # (n,)
    base: Array  # derivatives by all that the model has, (n, p)
    weight: Array  # (n,)
    gram: Gram  # of the base and the residual

    @classmethod
    def of(
        cls,
        dataset: Dataset,
        value: Array,
        jacobian: Jacobian,
        noise: Noise,
        needed: Sequence[bool] | None = None,
    ) -> "Remainder":
        """Of a model with the `needed` of its findings (None: all); `value` as simulated."""
        rows = list(range(jacobian.sensors.stop))
        for part, wanted in zip(jacobian.own, needed or [True] * len(jacobian.own), strict=True):
            rows += range(part.start, part.stop) if wanted else ()
        residual = (dataset.value - value) * noise.weight
        base = jacobian.matrix[:, rows] * noise.weight[:, None]
        return cls(dataset, residual, base, noise.weight, Gram.of(base, residual))

    def solved(self, parts: Sequence[Array]) -> Solution:
        """With further whitened columns, (n, k) each; next to nothing but zeros in each of them."""
        more = np.concatenate([*parts, np.empty((len(self.residual), 0))], axis=1)
        shown = np.flatnonzero(more.any(axis=1))
        own, cross = more[shown].T @ more[shown], self.base[shown].T @ more[shown]
        gram = Gram(
            np.block([[self.gram.matrix, cross], [cross.T, own]]),
            np.concatenate([self.gram.vector, more[shown].T @ self.residual[shown]]),
            self.gram.square,
        )
        return solve(gram, range(len(gram.vector)))


@frozen
class Unmodelled:
    """The family of torques that explains most of what is left."""

    family: Family
    evidence: float  # log, against nothing but the named model, of all wheels that have it
    wheels: tuple[int, ...]
    columns: Array  # of its basis functions at those wheels, whitened, (n, k)
    shape: Shape  # at the first of those wheels
    weights: tuple[Array, ...]  # of the basis functions at those wheels [N m], (k,) each

    def torque(self, motion: Motion) -> Array:
        """What it amounts to on a drive, at each wheel [N m], (n, 3)."""
        found = np.zeros_like(motion.speed)
        basis = self.family.torques(motion)
        for wheel, weights in zip(self.wheels, self.weights, strict=True):
            found[:, wheel] = weights @ basis[:, :, wheel]
        return found


def unmodelled_effects(
    rest: Remainder, basis: BasisResponses, variables: Collection[str] | None = None
) -> list[Unmodelled]:
    """Each family of torques (None: all) with its evidence, best first."""
    found = [
        _fitted(rest, basis, family, response)
        for family, response in zip(basis.families, basis.responses, strict=True)
        if variables is None or family.variable in variables
    ]
    return sorted(found, key=lambda item: -item.evidence)


def _fitted(rest: Remainder, basis: BasisResponses, family: Family, response: Array) -> Unmodelled:
    count, first = response.shape[1], len(rest.gram.vector)
    parts = [_only(response * rest.weight[:, None], rows) for rows in basis.rows]
    alone = rest.solved(()).evidence
    by_wheel = [rest.solved((part,)).evidence - alone for part in parts]
    least = max(_WHEEL_SHARE * max(by_wheel), _NEEDED)
    wheels = tuple(wheel for wheel in range(WHEELS) if by_wheel[wheel] > least)
    wheels = wheels or (int(np.argmax(by_wheel)),)
    chosen = [parts[wheel] for wheel in wheels]
    whole = rest.solved(chosen)
    weights = tuple(basis.size * part for part in np.split(whole.mean[first:], len(wheels)))
    rows = slice(first, first + count)
    name = rest.dataset.simulations[0].robot.wheel_names[wheels[0]]
    shape = _shape(family, name, weights[0], basis.size**2 * whole.covariance[rows, rows])
    columns = np.concatenate(chosen, axis=1)
    return Unmodelled(family, whole.evidence - alone, wheels, columns, shape, weights)


def _only(columns: Array, rows: NDArray[np.intp]) -> Array:
    kept = np.zeros_like(columns)
    kept[rows] = columns[rows]
    return kept


def _shape(family: Family, wheel: str, weights: Array, covariance: Array) -> Shape:
    """The curve of some weights of basis functions [N m], with its interval."""
    first, last = (0.0, 2.0 * np.pi) if family.is_periodic else family.knots[[0, -1]]
    at = np.linspace(first, last, _POINTS)
    basis = family.at(at).T
    curve = basis @ weights
    half = 1.96 * np.sqrt(np.einsum("ij,jk,ik->i", basis, covariance, basis))
    return Shape(family.variable, wheel, at, curve, curve - half, curve + half)


def gains(
    rest: Remainder,
    jacobian: Jacobian,
    changes: Sequence[Array],
    unmodelled: Unmodelled | None = None,
) -> list[float]:
    """Log evidence that each named finding brings, all else fitted anew without it.

    Args:
        rest: what the model with all findings leaves.
        jacobian: derivatives at it.
        changes: what each of its findings adds to the values, (n,).
        unmodelled: an effect without a name whose torques are there as well.
    """
    both = rest.base
    if unmodelled is not None:
        both = np.concatenate([both, unmodelled.columns], axis=1)
    everything = list(range(both.shape[1]))
    gram = Gram.of(both, rest.residual)
    whole, found = _likelihood(gram, everything), []
    for part, change in zip(jacobian.own, changes, strict=True):
        others = [row for row in everything if not part.start <= row < part.stop]
        lacking = rest.residual + change * rest.weight
        other = Gram(gram.matrix, both.T @ lacking, float(lacking @ lacking))
        found.append(whole - _likelihood(other, others))
    return found


def still_needed(model: Model, gained: Sequence[float], unmodelled: Unmodelled) -> list[bool]:
    """Whether each finding of a model is needed, from what it brings beside the unmodelled one."""
    least = max(_NEEDED, SIMULATOR.beside_unmodelled * unmodelled.evidence)
    robot = model.described.robot
    return [
        gain > least and not _contradicts(unmodelled, hypothesis, robot)
        for gain, hypothesis in zip(gained, model.hypotheses, strict=True)
    ]


def _contradicts(unmodelled: Unmodelled, hypothesis: Hypothesis, robot: Robot) -> bool:
    """Whether what is left is of the same variable and wheel: then it is not of the named shape."""
    if _SHAPED.get(hypothesis.effect) != unmodelled.family.variable:
        return False
    wheels = {robot.wheel_names[wheel] for wheel in unmodelled.wheels}
    return bool(wheels & set(hypothesis.where)) or "all_wheels" in hypothesis.where


def _likelihood(gram: Gram, chosen: Sequence[int]) -> float:
    """Log evidence of some columns, up to what all residuals of one weighting share."""
    return solve(gram, chosen).evidence - 0.5 * gram.square


def names(wheels: Sequence[int], robot: Robot) -> tuple[str, ...]:
    """Wheels as a report names them."""
    return ("all_wheels",) if len(wheels) == WHEELS else tuple(robot.wheel_names[w] for w in wheels)
