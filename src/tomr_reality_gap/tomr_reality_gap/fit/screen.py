"""All additions as the linear model sees them: what each would bring, and where to start from it.

Everything is linearised at the model so far; nuisances that would leave their tolerance are held
at its edge, and parameters that an addition would push far out of it are tried together with it.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_reality_gap.fit.linear import Gram, Solution, solve
from tomr_reality_gap.fit.noise import Noise
from tomr_reality_gap.fit.refine import LARGEST_STEP, State, largest_step, moved, turns_of
from tomr_reality_gap.fit.study import Columns, Model, Study
from tomr_reality_gap.hypotheses.knobs import Hypothesis

Array = NDArray[np.float64]

_STARTED = 5  # best additions for which starts are worked out
_FAR = 2.0  # tolerances
_COMPANIONS = 2


@frozen
class Screened:
    """An addition as the linear model sees it."""

    gain: float
    hypothesis: Hypothesis
    companions: tuple[Hypothesis, ...]  # parameters that would have to be wrong besides
    starts: tuple[State, ...] = ()  # with the hypothesis, and with more and more companions


def screen(
    study: Study, columns: Columns, noise: Noise, candidates: Sequence[Hypothesis]
) -> tuple[State, list[Screened]]:
    """The linear model's best turns, and its gain in evidence by each addition, best first."""
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    turns = turns_of(columns.model, np.zeros(columns.instruments.stop - columns.instruments.start))
    # Data as if nothing had been turned yet: beliefs are about whole turns.
    residual = study.value - columns.value + columns.matrix[:, :kept] @ turns
    linear = _Linear.of(columns, residual, noise, kept)
    before = solve(linear.gram, linear.base).evidence
    best: dict[str, Screened] = {}
    for candidate in candidates:
        rows = linear.rows(candidate)
        if not rows:
            continue
        first = candidate.knobs[0]
        if first.leap:
            found = linear.leaped(rows[0], first.leap / first.spread)
        else:
            found = solve(linear.gram, [*linear.base, *rows])
            size = found.mean[len(linear.base)] * first.spread
            if len(rows) == 1 and not first.lower <= size <= first.upper:
                continue
        gain = found.evidence - before + candidate.weight
        if candidate.name not in best or gain > best[candidate.name].gain:
            needed = _companions(columns.model, linear.base, found.mean, candidate, candidates)
            best[candidate.name] = Screened(gain, candidate, needed)
    ranked = sorted(best.values(), key=lambda item: -item.gain)
    started = [evolve(item, starts=linear.starts(item)) for item in ranked[:_STARTED]]
    return linear.start(()), [*started, *ranked[_STARTED:]]


@frozen
class _Linear:
    """The linear model around the columns' model."""

    columns: Columns
    gram: Gram
    base: list[int]  # rows that are not held
    held: Mapping[int, float]  # turns of the others

    @classmethod
    def of(cls, columns: Columns, residual: Array, noise: Noise, kept: int) -> "_Linear":
        gram = Gram.of(columns.matrix, residual, noise.weight)
        base, held = _pinned(columns.model, gram, list(range(kept)))
        if held:
            known = gram.matrix[:, list(held)] @ np.array(list(held.values()))
            gram = evolve(gram, vector=gram.vector - known)
        return cls(columns, gram, base, held)

    def rows(self, candidate: Hypothesis) -> list[int]:
        """Rows of a candidate that show anywhere."""
        part = self.columns.candidates[candidate.key]
        return [row for row in range(part.start, part.stop) if self.gram.matrix[row, row] > 0.0]

    def leaped(self, row: int, turn: float) -> Solution:
        """With one column turned by just so much: what was simulated, not a part of it."""
        gram = self.gram
        vector = gram.vector - turn * gram.matrix[:, row]
        found = solve(evolve(gram, vector=vector), self.base)
        fits = turn * float(gram.vector[row]) - 0.5 * turn**2 * float(gram.matrix[row, row])
        return evolve(found, evidence=found.evidence + fits - 0.5 * turn**2)

    def starts(self, item: Screened) -> tuple[State, ...]:
        """Where to start with a hypothesis, and with more and more of its companions."""
        together = (item.hypothesis, *item.companions)
        return tuple(self.start(together[: count + 1]) for count in range(len(together)))

    def start(self, additions: tuple[Hypothesis, ...]) -> State:
        """The best turns with some hypotheses more."""
        rows = [row for item in additions for row in self.rows(item)]
        mean = solve(self.gram, [*self.base, *rows]).mean
        known = dict(zip([*self.base, *rows], mean.tolist(), strict=True)) | dict(self.held)
        columns, model = self.columns, self.columns.model
        kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
        turns = [known[row] for row in range(kept)]
        for item in additions:
            model = model.joined(item)
            part = columns.candidates[item.key]
            first = item.knobs[0]
            own = [known.get(row, 0.0) for row in range(part.start, part.stop)]
            if first.leap:  # its derivative is that of the whole leap: half of one is nowhere
                own = [first.leap / first.spread]
            turns += own + [0.0] * (len(item.knobs) - len(own))
        limit = np.full(len(turns), LARGEST_STEP)
        limit[len(turns) - len(model.own) :] = [largest_step(knob) for knob in model.own]
        return moved(model, np.clip(np.array(turns), -limit, limit), columns)


def _companions(
    model: Model,
    base: Sequence[int],
    mean: Array,
    candidate: Hypothesis,
    candidates: Sequence[Hypothesis],
) -> tuple[Hypothesis, ...]:
    """Parameters that an addition would push far out of their tolerance: wrong ones, then."""
    turns = dict(zip(base, mean, strict=False))
    far: dict[str, float] = {}
    out: set[str] = set()  # out of their tolerance, or held at its edge
    for row, knob in enumerate(model.nuisances):
        excess = abs(turns.get(row, math.inf)) * knob.spread / knob.upper
        if excess > 1.0:
            out.add(knob.keys[0])
        if _FAR < excess < math.inf:
            far[knob.keys[0]] = excess
    own = {key for knob in candidate.knobs for key in knob.keys}
    found: list[tuple[float, Hypothesis]] = []
    for other in sorted(candidates, key=lambda item: -len(item.knobs[0].keys)):
        keys = set(other.knobs[0].keys)
        excess = max((far.get(key, 0.0) for key in keys), default=0.0)
        if not other.effect.startswith("parameter.") or keys & own or excess == 0.0:
            continue
        if len(keys & out) > len(keys) // 2:
            found.append((excess, other))
            far = {key: value for key, value in far.items() if key not in keys}
    found.sort(key=lambda pair: -pair[0])
    return tuple(other for _, other in found[:_COMPANIONS])


def _pinned(model: Model, gram: Gram, rows: list[int]) -> tuple[list[int], dict[int, float]]:
    """Rows kept, and nuisances that would leave their tolerance, held at its edge."""
    kept, held = [], {}
    for row, turn in zip(rows, solve(gram, rows).mean.tolist(), strict=True):
        knob = model.nuisances[row] if row < len(model.nuisances) else None
        edge = math.inf if knob is None else knob.upper / knob.spread
        if abs(turn) > edge:
            held[row] = math.copysign(edge, turn)
        else:
            kept.append(row)
    return kept, held
