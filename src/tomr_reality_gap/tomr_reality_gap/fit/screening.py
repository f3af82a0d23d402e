"""All additions as the linear model sees them: what each would bring, and where to start from it.

Everything is linearised at the model so far; nuisances that would leave their tolerance are held
at its edge, and parameters that an addition would push far out of it are tried together with it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, Solution, solve
from tomr_power_model.estimation.noise import Noise
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.jacobian import Jacobian
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import State, largest_steps, state_at, units_of
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

Array = NDArray[np.float64]

_STARTED = 5  # best additions for which starts are worked out
_FAR = 2.0  # tolerances
_MOST_JOINT = 2
_PAIRED = 16  # best additions of which pairs are tried
_PAIRS = 2  # that are started


@frozen
class Screened:
    """An addition as the linear model sees it."""

    gain: float
    hypothesis: Hypothesis
    joint_candidates: tuple[Hypothesis, ...]  # parameters that would have to be wrong besides
    starts: tuple[State, ...] = ()  # with the hypothesis, and with more and more joint candidates


def screen(
    dataset: Dataset, jacobian: Jacobian, noise: Noise, candidates: Sequence[Hypothesis]
) -> tuple[State, list[Screened]]:
    """The linear model's best offsets, and its gain in evidence by each addition, best first."""
    kept, sensors = jacobian.kept, jacobian.sensors
    units = units_of(jacobian.model, np.zeros(sensors.stop - sensors.start))
    # Data as if nothing were offset yet: priors are about whole offsets.
    residual = dataset.value - jacobian.value + jacobian.matrix[:, :kept] @ units
    linear = _Linear.of(jacobian, residual, noise)
    before = solve(linear.gram, linear.base).evidence
    best: dict[str, Screened] = {}
    for candidate in candidates:
        rows = linear.rows(candidate)
        if not rows:
            continue
        first = candidate.parameters[0]
        if first.discrete_offset:
            found = linear.at_discrete_offset(rows[0], first.discrete_offset / first.prior_std)
        else:
            found = solve(linear.gram, [*linear.base, *rows])
            size = found.mean[len(linear.base)] * first.prior_std
            if len(rows) == 1 and not first.lower <= size <= first.upper:
                continue
        gain = found.evidence - before + candidate.log_prior
        if candidate.name not in best or gain > best[candidate.name].gain:
            units = np.full(kept, np.inf)  # of what is held
            units[linear.base] = found.mean[: len(linear.base)]
            joint = joint_candidates(jacobian.model, units, candidate, candidates)
            best[candidate.name] = Screened(gain, candidate, joint)
    ranked = sorted(best.values(), key=lambda item: -item.gain)
    started = [evolve(item, starts=linear.starts(item)) for item in ranked[:_STARTED]]
    pairs = sorted(_pairs(linear, before, ranked[:_PAIRED]), key=lambda item: -item.gain)
    return linear.start(()), [*started, *pairs[:_PAIRS], *ranked[_STARTED:]]


def _pairs(linear: "_Linear", before: float, ranked: Sequence[Screened]) -> Iterator[Screened]:
    """Two additions at once that are worth more than either: effects that hide each other."""
    for one, other in combinations([item for item in ranked if not is_discrete(item)], 2):
        together = (one.hypothesis, other.hypothesis)
        gain = linear.gain(together, before)
        if not exclude_each_other(*together) and gain > max(one.gain, other.gain):
            yield Screened(gain, together[0], together[1:], (linear.start(together),))


def is_discrete(item: Screened) -> bool:
    """Whether an addition is tried as a whole."""
    return bool(item.hypothesis.parameters[0].discrete_offset)


def exclude_each_other(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses change the same numbers."""
    keys = {key for parameter in one.parameters for key in parameter.keys}
    return any(keys.intersection(parameter.keys) for parameter in other.parameters)


@frozen
class _Linear:
    """The linear model around the Jacobian's model."""

    jacobian: Jacobian
    gram: Gram
    base: list[int]  # rows that are not held
    held: Mapping[int, float]  # offsets of the others

    @classmethod
    def of(cls, jacobian: Jacobian, residual: Array, noise: Noise) -> "_Linear":
        gram = Gram.of(jacobian.matrix, residual, noise.weight)
        base, held = _pinned(jacobian.model, gram, jacobian.kept)
        if held:
            known = gram.matrix[:, list(held)] @ np.array(list(held.values()))
            gram = evolve(gram, vector=gram.vector - known)
        return cls(jacobian, gram, base, held)

    def rows(self, candidate: Hypothesis) -> list[int]:
        """Rows of a candidate that show anywhere."""
        part = self.jacobian.candidates[candidate.key]
        return [row for row in range(part.start, part.stop) if self.gram.matrix[row, row] > 0.0]

    def at_discrete_offset(self, row: int, offset: float) -> Solution:
        """With one column offset by just so much: what was simulated, not a part of it."""
        gram = self.gram
        vector = gram.vector - offset * gram.matrix[:, row]
        found = solve(evolve(gram, vector=vector), self.base)
        fits = offset * float(gram.vector[row]) - 0.5 * offset**2 * float(gram.matrix[row, row])
        return evolve(found, evidence=found.evidence + fits - 0.5 * offset**2)

    def gain(self, additions: Sequence[Hypothesis], before: float) -> float:
        """What additions bring together; nothing where a size would be beyond its bounds."""
        rows = [(row, item) for item in additions for row in self.rows(item)]
        found = solve(self.gram, [*self.base, *(row for row, _ in rows)])
        prior = sum(item.log_prior for item in additions)
        at = len(self.base)
        for item in additions:
            first, size = item.parameters[0], found.mean[at] * item.parameters[0].prior_std
            at += len(self.rows(item))
            if not first.lower <= size <= first.upper:
                return -math.inf
        return found.evidence - before + prior

    def starts(self, item: Screened) -> tuple[State, ...]:
        """Where to start with a hypothesis, and with more and more of its joint candidates."""
        together = (item.hypothesis, *item.joint_candidates)
        return tuple(self.start(together[: count + 1]) for count in range(len(together)))

    def start(self, additions: tuple[Hypothesis, ...]) -> State:
        """The best offsets with some hypotheses more."""
        rows = [row for item in additions for row in self.rows(item)]
        mean = solve(self.gram, [*self.base, *rows]).mean
        known = dict(zip([*self.base, *rows], mean.tolist(), strict=True)) | dict(self.held)
        jacobian, model = self.jacobian, self.jacobian.model
        units = [known[row] for row in range(jacobian.kept)]
        for item in additions:
            model = model.joined(item)
            part = jacobian.candidates[item.key]
            first = item.parameters[0]
            own = [known.get(row, 0.0) for row in range(part.start, part.stop)]
            if first.discrete_offset:  # its derivative is that of the whole: half of it is nowhere
                own = [first.discrete_offset / first.prior_std]
            units += own + [0.0] * (len(item.parameters) - len(own))
        limit = largest_steps(model, jacobian.sensors.stop - jacobian.sensors.start)
        return state_at(model, np.clip(np.array(units), -limit, limit), jacobian)


def joint_candidates(
    model: Model, units: Array, candidate: Hypothesis, candidates: Sequence[Hypothesis]
) -> tuple[Hypothesis, ...]:
    """Parameters that an addition would push far out of their tolerance: wrong ones, then.

    `units` are the model's offsets with the addition [prior_stds], infinite where held at an edge.
    """
    far: dict[str, float] = {}
    out: set[str] = set()  # out of their tolerance, or held at its edge
    for parameter, unit in zip(model.nuisances, units.tolist(), strict=False):
        excess = abs(unit) * parameter.prior_std / parameter.upper
        if excess > 1.0:
            out.add(parameter.keys[0])
        if _FAR < excess < math.inf:
            far[parameter.keys[0]] = excess
    own = {key for parameter in candidate.parameters for key in parameter.keys}
    found: list[tuple[float, Hypothesis]] = []
    for other in sorted(candidates, key=lambda item: -len(item.parameters[0].keys)):
        keys = set(other.parameters[0].keys)
        excess = max((far.get(key, 0.0) for key in keys), default=0.0)
        if not other.effect.startswith("parameter.") or keys & own or excess == 0.0:
            continue
        if len(keys & out) > len(keys) // 2:
            found.append((excess, other))
            far = {key: value for key, value in far.items() if key not in keys}
    found.sort(key=lambda pair: -pair[0])
    return tuple(other for _, other in found[:_MOST_JOINT])


def _pinned(model: Model, gram: Gram, count: int) -> tuple[list[int], dict[int, float]]:
    """Rows kept, and nuisances that would leave their tolerance, held at its edge."""
    kept, held = [], {}
    for row, offset in enumerate(solve(gram, range(count)).mean.tolist()):
        parameter = model.nuisances[row] if row < len(model.nuisances) else None
        edge = math.inf if parameter is None else parameter.upper / parameter.prior_std
        if abs(offset) > edge:
            held[row] = math.copysign(edge, offset)
        else:
            kept.append(row)
    return kept, held
