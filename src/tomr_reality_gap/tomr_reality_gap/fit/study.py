"""Recordings to be explained, as numbers: residuals and derivatives by every knob."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, Channel
from tomr_reality_gap.alignment.simulation import (
    RecordingSimulation,
    Tick,
    predict_all,
    respond_all,
)
from tomr_reality_gap.fit.linear import Matrix
from tomr_reality_gap.hypotheses.knobs import Hypothesis, Knob, Turned

Array = NDArray[np.float64]

_DELAY_STEP = 5e-4  # s
_DELAY_SPREAD = 2e-3  # s, of the response to commands
_CLOCK_SPREAD = 1e-3  # s, of each power sensor's stamps
_GYRO_BIAS = 0.02  # rad/s
_GYRO_SCALE = 0.01


@frozen
class Study:
    """All recordings together; rows are the channels of one after another."""

    simulations: tuple[RecordingSimulation, ...]
    channels: tuple[Channel, ...] = field(init=False)
    value: Array = field(init=False)  # measured, (n,)

    def __attrs_post_init__(self) -> None:
        channels = tuple(channel for item in self.simulations for channel in item.channels)
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "value", np.concatenate([item.value for item in channels]))

    def predict(
        self,
        robots: Sequence[Robot],
        tick: Tick = lambda done: None,
        later: Sequence[float] = (),
    ) -> Array:
        """As `RecordingSimulation.predict`, of all recordings' channels, (v + l, n)."""
        return predict_all(self.simulations, robots, tick, later)

    def sloped(
        self, robot: Robot, others: Sequence[Robot], scale: Array, tick: Tick = lambda done: None
    ) -> tuple[Array, Array, NDArray[np.float32]]:
        """Values of a robot, their derivative in time, (n,) each, and what others change in them.

        Args:
            robot: the robot.
            others: others.
            scale: what each of them changes is multiplied by this, (v,).
            tick: called for each simulated robot.
        """
        value, slope, first = np.empty_like(self.value), np.empty_like(self.value), 0
        changes = np.empty((len(others), len(value)), dtype=np.float32)
        for item in self.simulations:
            part = slice(first, first := first + item.size)
            shown = item.predicted([robot, *others], tick, (_DELAY_STEP,))
            value[part] = next(shown)
            for row in range(len(others)):
                changes[row, part] = (next(shown) - value[part]) * scale[row]
            slope[part] = (value[part] - next(shown)) / _DELAY_STEP
        return value, slope, changes

    def respond(self, robot: Robot, torques: Sequence[Array]) -> Array:
        """As `RecordingSimulation.respond`, torques one array (v, count, 3) per recording."""
        return respond_all(self.simulations, robot, torques)

    def instruments(self, value: Array, slope: Array) -> Array:
        """Columns of what instruments may be off, in units of their beliefs, (n, k).

        The response of each recording and the stamps of each power sensor in time; each gyro's
        bias and scale.
        """
        columns, row = [], 0

        def add(part: slice, change: Array) -> None:
            column = np.zeros_like(value)
            column[part] = change[part]
            columns.append(column)

        for item in self.simulations:
            size = sum(len(channel.time) for channel in item.channels)
            add(slice(row, row + size), -_DELAY_SPREAD * slope)
            for channel in item.channels:
                part = slice(row, row := row + len(channel.time))
                if channel.kind in DRAWN_KINDS:
                    add(part, -_CLOCK_SPREAD * slope)
                elif channel.kind == "yaw":
                    add(part, np.full_like(value, _GYRO_BIAS))
                    add(part, _GYRO_SCALE * value)
        return np.stack(columns, axis=1)


@frozen
class Model:
    """A description and what has been turned in it so far."""

    base: Turned
    nuisances: tuple[Knob, ...]
    nuisance_turns: tuple[float, ...]
    hypotheses: tuple[Hypothesis, ...] = ()
    turns: tuple[tuple[float, ...], ...] = ()  # of each hypothesis' knobs

    @property
    def described(self) -> Turned:
        """The description with everything turned."""
        start: dict[str, float] = {}
        for hypothesis in self.hypotheses:
            start.update(hypothesis.start)
        changed = self.base.given(start).by(self.nuisances, self.nuisance_turns)
        for hypothesis, turns in zip(self.hypotheses, self.turns, strict=True):
            changed = changed.by(hypothesis.knobs, turns)
        return changed

    @property
    def own(self) -> tuple[Knob, ...]:
        """Knobs of the hypotheses, in order."""
        return tuple(knob for hypothesis in self.hypotheses for knob in hypothesis.knobs)

    @property
    def own_turns(self) -> tuple[float, ...]:
        return tuple(turn for turns in self.turns for turn in turns)

    @property
    def names(self) -> frozenset[str]:
        """Names of the hypotheses."""
        return frozenset(hypothesis.name for hypothesis in self.hypotheses)

    def joined(self, hypothesis: Hypothesis) -> "Model":
        """With one more hypothesis, not turned yet."""
        return evolve(
            self,
            hypotheses=(*self.hypotheses, hypothesis),
            turns=(*self.turns, (0.0,) * len(hypothesis.knobs)),
        )

    def without(self, number: int) -> "Model":
        """With one hypothesis less."""
        keep = [index for index in range(len(self.hypotheses)) if index != number]
        return evolve(
            self,
            hypotheses=tuple(self.hypotheses[index] for index in keep),
            turns=tuple(self.turns[index] for index in keep),
        )

    def swapped(self, number: int, hypothesis: Hypothesis, turns: tuple[float, ...]) -> "Model":
        """With another hypothesis in the place of one."""
        hypotheses, all_turns = list(self.hypotheses), list(self.turns)
        hypotheses[number], all_turns[number] = hypothesis, turns
        return evolve(self, hypotheses=tuple(hypotheses), turns=tuple(all_turns))

    def moved(self, nuisance: Array, own: Array) -> "Model":
        """With all knobs at new turns, within their bounds."""
        nuisance = np.clip(
            nuisance,
            [knob.lower for knob in self.nuisances],
            [knob.upper for knob in self.nuisances],
        )
        turns, at = [], 0
        for hypothesis in self.hypotheses:
            part = own[at : (at := at + len(hypothesis.knobs))]
            turns.append(
                tuple(
                    float(np.clip(turn, knob.lower, knob.upper))
                    for knob, turn in zip(hypothesis.knobs, part, strict=True)
                )
            )
        return evolve(self, nuisance_turns=tuple(nuisance.tolist()), turns=tuple(turns))


@frozen
class Columns:
    """Derivatives at one model, in units of each knob's spread; rows are samples."""

    model: Model
    value: Array  # simulated, (n,)
    slope: Array  # in time, (n,)
    matrix: Matrix  # (n, p): nuisances, instruments, the model's own, candidates
    nuisance: slice
    instruments: slice
    own: tuple[slice, ...]  # of each of the model's hypotheses
    candidates: Mapping[tuple[object, ...], slice]  # of each candidate, by its key


def columns_at(
    study: Study,
    model: Model,
    candidates: Sequence[Hypothesis],
    tick: Tick = lambda done: None,
    before: Columns | None = None,
) -> Columns:
    """Derivatives by everything that a model and its possible additions can turn.

    With `before` the derivatives by nuisances and candidates are taken from there: they change
    little from one model to the next, and cost most.
    """
    described = model.described
    robots: list[Robot] = []
    knobs: list[Knob] = list(model.own)
    if before is None:
        knobs = [*model.nuisances, *model.own]
    steps = [_step(knob, model) for knob in knobs]
    robots += [described.by([k], [step]).robot for k, step in zip(knobs, steps, strict=True)]
    for candidate in candidates if before is None else ():
        started = described.given(
            {key: at for key, at in candidate.start.items() if key not in described.values}
        )
        for knob in (knob for knob in candidate.knobs if not knob.is_shape):
            robots.append(started.by([knob], [knob.first_step]).robot)
            steps.append(knob.first_step)
            knobs.append(knob)
    scale = np.array([knob.spread for knob in knobs]) / np.array(steps)
    value, slope, changes = study.sloped(described.robot, robots, scale, tick)
    instruments = study.instruments(value, slope)
    first = len(model.nuisances)
    own = len(model.own)
    nuisance: Matrix
    others: list[Matrix]
    if before is None:
        nuisance, mine = changes[:first], changes[first : first + own]
        others = [changes[first + own :]]
    else:
        nuisance, mine = before.matrix[:, before.nuisance].T, changes
        others = [before.matrix[:, before.candidates[item.key]].T for item in candidates]
    edge = first + instruments.shape[1]
    parts, found = [], {}
    for hypothesis in model.hypotheses:
        parts.append(slice(edge, edge := edge + len(hypothesis.knobs)))
    for candidate in candidates:
        sizes = sum(not knob.is_shape for knob in candidate.knobs)
        found[candidate.key] = slice(edge, edge := edge + sizes)
    return Columns(
        model,
        value,
        slope,
        np.concatenate([nuisance, instruments.T, mine, *others], dtype=np.float32).T,
        slice(0, first),
        slice(first, first + instruments.shape[1]),
        tuple(parts),
        found,
    )


def _step(knob: Knob, model: Model) -> float:
    """Step of a derivative that stays within the knob's bounds."""
    turned = dict(zip((k.name + k.keys[0] for k in model.own), model.own_turns, strict=True))
    at = turned.get(knob.name + knob.keys[0], 0.0)
    return -knob.step if at + knob.step > knob.upper else knob.step
