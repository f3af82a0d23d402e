"""Which hypotheses explain the recordings: forward, with swaps and removals, by evidence.

Each round linearises everything at the model so far, ranks all additions by the evidence of the
linear Gaussian model, refines the best few with the simulator, and takes the one whose evidence,
now of the nonlinear model (Laplace), is highest:

    log p = -1/2 |r|^2 - 1/2 |u|^2 - 1/2 log|I + G| + log prior

with r the whitened residual, u all turns in units of their beliefs, G their normal matrix.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.noise import Noise, noise_of
from tomr_reality_gap.fit.study import Columns, Model, Study, columns_at
from tomr_reality_gap.hypotheses.knobs import Hypothesis

Array = NDArray[np.float64]
Tick = Callable[[int], None]

_COST = 20.0  # log evidence that an addition must bring: about e^20 : 1
_COST_SHARE = 0.003  # of the samples: the simulator is not exact, and many samples show it
_REFINED = 5  # best additions that are tried with the simulator
_STEPS = 2  # of Gauss-Newton
_LARGEST_STEP = 4.0  # spreads
_MOST_FINDINGS = 4
_NOTHING = 1e-3  # spreads
_FAR = 2.0  # tolerances
_COMPANIONS = 2
_SIGMAS = 3.0  # that a size must be away from nothing


@frozen
class Fitted:
    """A model at its best turns."""

    model: Model
    evidence: float  # log, prior included; differences count
    chi2: float
    timing: Array  # turns of the instruments [spreads]
    covariance: Array  # of (nuisances, timing, own knobs) [spreads]
    value: Array  # simulated, timing included, (n,)

    @property
    def own_sigma(self) -> Array:
        """Standard deviations of the hypotheses' knobs, in their units."""
        count = len(self.model.own)
        if not count:
            return np.empty(0)
        spread = np.array([knob.spread for knob in self.model.own])
        return np.asarray(np.sqrt(np.diag(self.covariance)[-count:]) * spread)


@frozen
class Screened:
    """An addition as the linear model sees it."""

    gain: float
    hypothesis: Hypothesis
    companions: tuple[Hypothesis, ...]  # parameters that would have to be wrong besides


@frozen
class Round:
    """One linearisation and what was tried from it."""

    columns: Columns
    noise: Noise
    tried: tuple[Fitted, ...]  # refined additions, best first
    screened: tuple[Screened, ...]  # by their linear gains, best first


@frozen
class Found:
    """Outcome of a search."""

    best: Fitted
    without: Fitted  # nothing but tolerances
    rounds: tuple[Round, ...]
    noise: Noise
    alternatives: tuple[tuple[Fitted, ...], ...] = field(factory=tuple)  # for each finding


def search(
    study: Study, start: Model, candidates: Sequence[Hypothesis], tick: Tick = lambda done: None
) -> Found:
    """Add hypotheses while they bring evidence."""
    rounds: list[Round] = []
    current: Fitted | None = None
    without: Fitted | None = None
    model = start
    while True:
        open_ones = [item for item in candidates if item.name not in model.names]
        columns = columns_at(study, model, open_ones, tick, rounds[0].columns if rounds else None)
        noise = _noise(study, columns)
        fitted = refine(study, [model], columns, noise, tick)[0]
        current = fitted
        without = without or fitted
        screened = _screen(study, columns, noise, open_ones)
        tried = _tried(study, fitted.model, screened[:_REFINED], columns, noise, tick)
        cost = finding_cost(study)
        tried.sort(key=lambda item: len(item.model.hypotheses) * cost - item.evidence)
        rounds.append(Round(columns, noise, tuple(tried), tuple(screened)))
        added = len(tried[0].model.hypotheses) - len(model.hypotheses) if tried else 0
        if not tried or tried[0].evidence < current.evidence + added * cost:
            break
        model = tried[0].model
        if len(model.hypotheses) > _MOST_FINDINGS:
            break
    return Found(current, without, tuple(rounds), noise)


def _tried(
    study: Study,
    model: Model,
    screened: Sequence[Screened],
    columns: Columns,
    noise: Noise,
    tick: Tick,
) -> list[Fitted]:
    """Refine additions, alone and with the wrong parameters that they would need."""
    trials = []
    for item in screened:
        joined = model.joined(item.hypothesis)
        trials.append(joined)
        for companion in item.companions:
            joined = joined.joined(companion)
            trials.append(joined)
    fitted = refine(study, trials, columns, noise, tick)
    first = len(model.hypotheses)
    return [item for item in fitted if _is_large_enough(item, first)]


def finding_cost(study: Study) -> float:
    """Log evidence that a finding must bring."""
    return max(_COST, _COST_SHARE * len(study.value))


def _is_large_enough(fitted: Fitted, first: int) -> bool:
    """Whether every hypothesis from the first added on has a size that can be told from none."""
    at = sum(len(item.knobs) for item in fitted.model.hypotheses[:first])
    for hypothesis, turns in zip(
        fitted.model.hypotheses[first:], fitted.model.turns[first:], strict=True
    ):
        sigma = float(fitted.own_sigma[at])
        at += len(turns)
        spread = hypothesis.knobs[0].spread
        if abs(turns[0]) <= max(hypothesis.least, _NOTHING * spread, _SIGMAS * sigma):
            return False
    return True


def _noise(study: Study, columns: Columns) -> Noise:
    return noise_of(
        study.channels,
        study.value - columns.value,
        columns.matrix,
        columns.value,
        columns.slope,
    )


def _turns(model: Model, timing: Array) -> Array:
    """All turns of a model in spreads: nuisances, timing, own."""
    nuisance = [
        turn / knob.spread for knob, turn in zip(model.nuisances, model.nuisance_turns, strict=True)
    ]
    own = [turn / knob.spread for knob, turn in zip(model.own, model.own_turns, strict=True)]
    return np.concatenate([nuisance, timing, own])


def _screen(
    study: Study, columns: Columns, noise: Noise, candidates: Sequence[Hypothesis]
) -> list[Screened]:
    """Linear gains in evidence of each addition, one per name, best first."""
    model = columns.model
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    base = list(range(kept))
    turns = _turns(model, np.zeros(columns.instruments.stop - columns.instruments.start))
    # Data as if nothing had been turned yet: beliefs are about whole turns.
    residual = study.value - columns.value + columns.matrix[:, :kept] @ turns
    weighted = columns.matrix * noise.weight[:, None]
    gram = Gram.of(weighted, residual * noise.weight)
    base, residual = _pinned(model, gram, base, columns, residual, noise)
    gram = Gram.of(weighted, residual * noise.weight)
    before = solve(gram, base).evidence
    best: dict[str, Screened] = {}
    for candidate in candidates:
        part = columns.candidates[candidate.key]
        rows = [row for row in range(part.start, part.stop) if gram.matrix[row, row] > 0.0]
        if not rows:
            continue
        found = solve(gram, [*base, *rows])
        size = found.mean[len(base)] * candidate.knobs[0].spread
        if len(rows) == 1 and not candidate.knobs[0].lower <= size <= candidate.knobs[0].upper:
            continue
        gain = found.evidence - before + candidate.weight
        if candidate.name not in best or gain > best[candidate.name].gain:
            needed = _companions(model, base, found.mean, candidate, candidates)
            best[candidate.name] = Screened(gain, candidate, needed)
    return sorted(best.values(), key=lambda item: -item.gain)


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


def _pinned(
    model: Model, gram: Gram, base: list[int], columns: Columns, residual: Array, noise: Noise
) -> tuple[list[int], Array]:
    """Nuisances that would leave their tolerance are held at its edge: rows kept, data without."""
    mean = solve(gram, base).mean
    kept, held = [], []
    for row, turn in zip(base, mean, strict=True):
        knob = model.nuisances[row] if row < len(model.nuisances) else None
        edge = math.inf if knob is None else knob.upper / knob.spread
        if abs(turn) > edge:
            held.append((row, math.copysign(edge, turn)))
        else:
            kept.append(row)
    for row, turn in held:
        residual = residual - columns.matrix[:, row] * turn
    return kept, residual


def refine(
    study: Study, models: Sequence[Model], columns: Columns, noise: Noise, tick: Tick
) -> list[Fitted]:
    """Gauss-Newton on each model; nuisances keep the derivatives of `columns`."""
    if not models:
        return []
    still = np.zeros(columns.instruments.stop - columns.instruments.start)
    states = [(model, still) for model in models]
    for _ in range(_STEPS):
        places = _places(study, states, columns, noise, tick)
        states = [_step(at, model, columns) for at, (model, _) in zip(places, states, strict=True)]
    places = _places(study, states, columns, noise, tick)
    return [_assess(at, *state) for at, state in zip(places, states, strict=True)]


def _places(
    study: Study,
    states: Sequence[tuple[Model, Array]],
    columns: Columns,
    noise: Noise,
    tick: Tick,
) -> "list[_Equations]":
    """The equations of several models, simulated together."""
    points = _points(study, [model for model, _ in states], tick)
    return [
        _equations(study, model, instruments, point, columns, noise)
        for (model, instruments), point in zip(states, points, strict=True)
    ]


def _points(study: Study, models: Sequence[Model], tick: Tick) -> list[tuple[Array, Array]]:
    """Simulated values and derivatives by the models' own knobs (in spreads) of each model."""
    robots, sizes = [], []
    for model in models:
        described = model.described
        robots.append(described.robot)
        turns = model.own_turns
        steps = [
            -knob.step
            if turn + knob.step > knob.upper or turn + knob.step < knob.lower
            else knob.step
            for knob, turn in zip(model.own, turns, strict=True)
        ]
        robots += [
            described.by([knob], [step]).robot for knob, step in zip(model.own, steps, strict=True)
        ]
        sizes.append(
            np.array([knob.spread / step for knob, step in zip(model.own, steps, strict=True)])
        )
    values = study.predict(robots, tick)
    found, at = [], 0
    for size in sizes:
        part = values[at : (at := at + 1 + len(size))]
        found.append((part[0], (part[1:] - part[0]).T * size))
    return found


@frozen
class _Equations:
    """Normal equations of a model at one point, beliefs included."""

    turns: Array  # of everything [spreads]
    value: Array  # simulated, instruments included
    residual: Array  # whitened
    slope: Array  # of the log posterior by the turns
    factor: tuple[Array, bool]  # Cholesky factor of I + G


def _equations(
    study: Study,
    model: Model,
    instruments: Array,
    point: tuple[Array, Array],
    columns: Columns,
    noise: Noise,
) -> _Equations:
    value, own = point
    turns = _turns(model, instruments)
    fixed = columns.matrix[:, : columns.instruments.stop]
    matrix = np.concatenate([fixed, own], axis=1) * noise.weight[:, None]
    shifted = value + columns.matrix[:, columns.instruments] @ instruments
    residual = (study.value - shifted) * noise.weight
    factor = cho_factor(matrix.T @ matrix + np.eye(matrix.shape[1]), lower=True)
    return _Equations(turns, shifted, residual, matrix.T @ residual - turns, factor)


def _step(at: _Equations, model: Model, columns: Columns) -> tuple[Model, Array]:
    """One step of Gauss-Newton: the model, and the turns of the instruments."""
    change = np.clip(cho_solve(at.factor, at.slope), -_LARGEST_STEP, _LARGEST_STEP)
    return _moved(model, at.turns + change, columns)


def _moved(model: Model, turns: Array, columns: Columns) -> tuple[Model, Array]:
    first = columns.nuisance.stop
    last = columns.instruments.stop
    nuisance = turns[:first] * np.array([knob.spread for knob in model.nuisances])
    own = turns[last:] * np.array([knob.spread for knob in model.own])
    return model.moved(nuisance, own), turns[first:last]


def _assess(at: _Equations, model: Model, instruments: Array) -> Fitted:
    chi2 = float(at.residual @ at.residual)
    evidence = (
        -0.5 * chi2
        - 0.5 * float(at.turns @ at.turns)
        - float(np.log(np.diag(at.factor[0])).sum())
        + sum(item.weight for item in model.hypotheses)
    )
    covariance = cho_solve(at.factor, np.eye(len(at.turns)))
    return Fitted(model, evidence, chi2, instruments, covariance, at.value)
