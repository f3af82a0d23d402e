"""Models brought to their best turns: Gauss-Newton with the simulator.

A step that makes things worse is taken back and a part of it tried; what has settled, or is left
hopelessly behind by others, is not simulated further.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from attrs import define, frozen
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from tomr_reality_gap.fit.noise import Noise
from tomr_reality_gap.fit.study import Columns, Model, Study
from tomr_reality_gap.hypotheses.knobs import Knob

Array = NDArray[np.float64]
Tick = Callable[[int], None]
State = tuple[Model, Array]  # a model, and the turns of the instruments [spreads]

_MOST_STEPS = 6
_SETTLED = 0.5  # log evidence that a further step would bring
_BACK = 0.3  # of a step that made things worse
LARGEST_STEP = 4.0  # spreads
_MOST_OFF = 4.0  # spreads of an instrument: farther off it is a finding, and its column not linear
_HOPELESS = 100.0  # log evidence behind the best, after the step that is expected


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


def refine(
    study: Study, states: Sequence[State], columns: Columns, noise: Noise, tick: Tick
) -> list[Fitted]:
    """Each model at its best turns; nuisances keep the derivatives of `columns`."""
    climbs = [_Climb(state) for state in states]
    fixed = _Fixed.of(columns, noise)
    for _ in range(_MOST_STEPS):
        open_ones = [climb for climb in climbs if climb.is_open]
        if not open_ones:
            break
        points = _points(study, [climb.state[0] for climb in open_ones], tick)
        places = [
            _Equations.of(study, climb.state, point, fixed)
            for climb, point in zip(open_ones, points, strict=True)
        ]
        for climb, at in zip(open_ones, places, strict=True):
            climb.seen(at, columns)
        best = max(climb.evidence for climb in climbs)
        for climb in climbs:
            if climb.evidence + climb.expected < best - _HOPELESS:
                climb.is_open = False
    return [climb.fitted() for climb in climbs]


@define
class _Climb:
    """One model's way to its best turns."""

    state: State  # to be simulated next
    is_open: bool = True
    expected: float = math.inf  # log evidence of the next step
    _best: "_Equations | None" = None
    _best_state: State | None = None
    _change: Array | None = None

    @property
    def evidence(self) -> float:
        return -math.inf if self._best is None else self._best.evidence

    def seen(self, at: "_Equations", columns: Columns) -> None:
        """Take note of what the state was worth and choose the next."""
        if self._best is None or at.height > self._best.height:
            self._best, self._best_state = at, self.state
            change = cho_solve(at.factor, at.slope)
            self.expected = 0.5 * float(at.slope @ change)
            self._change = np.clip(change, -at.largest, at.largest)
        elif self._change is not None:
            self._change = _BACK * self._change
            self.expected *= _BACK
        self.is_open = self.expected > _SETTLED
        if self._best_state is not None and self._change is not None:
            turns = self._best.turns + self._change
            self.state = moved(self._best_state[0], turns, columns)

    def fitted(self) -> Fitted:
        assert self._best is not None
        assert self._best_state is not None
        at, (model, instruments) = self._best, self._best_state
        covariance = cho_solve(at.factor, np.eye(len(at.turns)))
        return Fitted(model, at.evidence, at.chi2, instruments, covariance, at.value)


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
class _Fixed:
    """Columns that all models share, whitened: nuisances and instruments."""

    columns: Array  # (n, q)
    gram: Array  # (q, q)
    weight: Array  # (n,)
    instruments: slice

    @classmethod
    def of(cls, columns: Columns, noise: Noise) -> "_Fixed":
        whitened = columns.matrix[:, : columns.instruments.stop] * noise.weight[:, None]
        return cls(whitened, whitened.T @ whitened, noise.weight, columns.instruments)


@frozen
class _Equations:
    """Normal equations of a model at one point, beliefs included."""

    turns: Array  # of everything [spreads]
    value: Array  # simulated, instruments included
    chi2: float
    slope: Array  # of the log posterior by the turns
    factor: tuple[Array, bool]  # Cholesky factor of I + G
    weight: float  # log of the belief in the hypotheses
    largest: Array  # steps that the derivatives are good for [spreads]

    @classmethod
    def of(
        cls,
        study: Study,
        state: State,
        point: tuple[Array, Array],
        fixed: _Fixed,
    ) -> "_Equations":
        """From the simulated values and derivatives of a state."""
        (value, own), (model, instruments) = point, state
        turns = turns_of(model, instruments)
        own = own * fixed.weight[:, None]
        cross, square = fixed.columns.T @ own, own.T @ own
        matrix = np.block([[fixed.gram, cross], [cross.T, square]])
        shifts = fixed.columns[:, fixed.instruments] @ instruments
        residual = (study.value - value) * fixed.weight - shifts
        factor = cho_factor(matrix + np.eye(len(matrix)), lower=True)
        largest = np.full(len(turns), LARGEST_STEP)
        largest[len(fixed.gram) :] = [largest_step(knob) for knob in model.own]
        return cls(
            turns,
            value + shifts / fixed.weight,
            float(residual @ residual),
            np.concatenate([fixed.columns.T @ residual, own.T @ residual]) - turns,
            factor,
            sum(item.weight for item in model.hypotheses),
            largest,
        )

    @property
    def height(self) -> float:
        """Log posterior of the turns."""
        return -0.5 * self.chi2 - 0.5 * float(self.turns @ self.turns)

    @property
    def evidence(self) -> float:
        """Log evidence (Laplace), the belief in the hypotheses included."""
        return self.height - float(np.log(np.diag(self.factor[0])).sum()) + self.weight


def largest_step(knob: Knob) -> float:
    """How far a derivative is good for [spreads]: a leap is no small step already."""
    return 1.0 if knob.leap else LARGEST_STEP


def turns_of(model: Model, instruments: Array) -> Array:
    """All turns of a model in spreads: nuisances, instruments, own."""
    nuisance = [
        turn / knob.spread for knob, turn in zip(model.nuisances, model.nuisance_turns, strict=True)
    ]
    own = [turn / knob.spread for knob, turn in zip(model.own, model.own_turns, strict=True)]
    return np.concatenate([nuisance, instruments, own])


def moved(model: Model, turns: Array, columns: Columns) -> State:
    """The model at other turns [spreads], within its knobs' bounds."""
    first = columns.nuisance.stop
    last = columns.instruments.stop
    nuisance = turns[:first] * np.array([knob.spread for knob in model.nuisances])
    own = turns[last:] * np.array([knob.spread for knob in model.own])
    return model.moved(nuisance, own), np.clip(turns[first:last], -_MOST_OFF, _MOST_OFF)
