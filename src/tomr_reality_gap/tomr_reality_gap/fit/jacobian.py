"""Derivatives of the recordings' values by everything that a model and its additions can change."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Matrix
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

Array = NDArray[np.float64]


@frozen
class Jacobian:
    """Derivatives at one model, in units of each parameter's prior_std; rows are samples."""

    model: Model
    value: Array  # simulated, (n,)
    time_derivative: Array  # of the value, (n,)
    matrix: Matrix  # (n, p): nuisances, sensor nuisances, the model's own, candidates
    nuisance: slice
    sensors: slice  # sensor nuisances
    own: tuple[slice, ...]  # of each of the model's hypotheses
    candidates: Mapping[tuple[object, ...], slice]  # of each candidate, by its key

    @property
    def kept(self) -> int:
        """Columns of all but the candidates; they come first."""
        return self.own[-1].stop if self.own else int(self.sensors.stop)


def linearise(
    dataset: Dataset,
    model: Model,
    candidates: Sequence[Hypothesis],
    tick: Tick = lambda done: None,
    *,
    before: Jacobian | None = None,
) -> Jacobian:
    """Derivatives at a model, by its parameters and those of candidates.

    With `before` the derivatives by candidates are taken from there: they change little from one
    model to the next, and cost most. They are the most memory as well, so its matrix is used
    again: `before` has none that holds afterwards.
    """
    varied = _all_varied(model, candidates, before is None)
    first, edge = len(model.nuisances), len(model.nuisances) + dataset.sensor_count
    kept = edge + len(model.own)
    count = kept + sum(len(c.sizes) for c in candidates)
    if before is None:
        matrix: Matrix = np.empty((count, len(dataset.value)), np.float32)
        into = [*matrix[:first], *matrix[edge:]]
    else:
        old = [row for item in candidates for row in _of(before.candidates[item.key])]
        matrix = _moved(before.matrix.T, count, list(zip(range(kept, count), old, strict=True)))
        into = [*matrix[:first], *matrix[edge:kept]]
    value, time_derivative = dataset.with_time_derivative(
        model.described.robot,
        [robot for robot, _ in varied],
        scale=np.array([scale for _, scale in varied]),
        into=into,
        tick=tick,
    )
    matrix[first:edge] = dataset.sensor_nuisances(value, time_derivative).T
    parts, found, at = [], {}, edge
    for hypothesis in model.hypotheses:
        parts.append(slice(at, at := at + len(hypothesis.parameters)))
    for candidate in candidates:
        found[candidate.key] = slice(at, at := at + len(candidate.sizes))
    return Jacobian(
        model,
        value,
        time_derivative,
        matrix.T,
        slice(0, first),
        slice(first, edge),
        tuple(parts),
        found,
    )


def _all_varied(
    model: Model, candidates: Sequence[Hypothesis], whole: bool
) -> list[tuple[Robot, float]]:
    """By whatever derivatives are taken: not of candidates where not `whole`."""
    described = model.described
    own = zip(model.own, model.own_offsets, strict=True)
    varied = [_varied(described, item, item.step) for item in model.nuisances]
    varied += [_varied(described, item, item.step_at(offset)) for item, offset in own]
    for candidate in candidates if whole else ():
        started = described.given(
            {key: at for key, at in candidate.start.items() if key not in described.values}
        )
        varied += [
            _varied(started, item, item.discrete_offset or item.step) for item in candidate.sizes
        ]
    return varied


def _varied(
    described: ParameterisedRobot, parameter: Parameter, step: float
) -> tuple[Robot, float]:
    """A robot with one parameter a step further, and what turns its change into a derivative."""
    return described.offset([parameter], [step]).robot, parameter.prior_std / step


def _of(part: slice) -> range:
    return range(part.start, part.stop)


def _moved(rows: Matrix, count: int, places: Sequence[tuple[int, int]]) -> Matrix:
    """Rows (count, n) with some of `rows` at new places (to, from), in the same order as before;
    in their own memory where that suffices."""
    moved = rows[:count] if count <= len(rows) else np.empty((count, rows.shape[1]), rows.dtype)
    forwards = [pair for pair in places if pair[0] > pair[1]]
    backwards = [pair for pair in places if pair[0] <= pair[1]]
    for to, at in [*reversed(forwards), *backwards]:  # none is overwritten before it has moved
        moved[to] = rows[at]
    return moved
