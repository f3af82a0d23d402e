"""Derivatives of the recordings' values by everything that a model and its additions can change."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Matrix
from tomr_power_model.estimation.parameter import prior_stds
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

    With `before` the derivatives by nuisances and candidates are taken from there: they change
    little from one model to the next, and cost most.
    """
    described = model.described
    parameters = [*([] if before else model.nuisances), *model.own]
    steps = [item.step for item in parameters[: len(parameters) - len(model.own)]]
    steps += [
        item.step_at(offset) for item, offset in zip(model.own, model.own_offsets, strict=True)
    ]
    robots = [described.offset([p], [s]).robot for p, s in zip(parameters, steps, strict=True)]
    for candidate in candidates if before is None else ():
        started = described.given(
            {key: at for key, at in candidate.start.items() if key not in described.values}
        )
        for parameter in candidate.sizes:
            step = parameter.discrete_offset or parameter.step
            robots.append(started.offset([parameter], [step]).robot)
            steps.append(step)
            parameters.append(parameter)
    first, edge = len(model.nuisances), len(model.nuisances) + dataset.sensor_count
    kept = edge + len(model.own)
    matrix = np.empty(
        (kept + sum(len(c.sizes) for c in candidates), len(dataset.value)), np.float32
    )
    if before is None:
        into = [*matrix[:first], *matrix[edge:]]
    else:
        into = list(matrix[edge:kept])
        old = [before.nuisance, *(before.candidates[item.key] for item in candidates)]
        matrix[:first] = before.matrix[:, old[0]].T
        if candidates:
            np.concatenate([before.matrix[:, part].T for part in old[1:]], out=matrix[kept:])
    value, time_derivative = dataset.with_time_derivative(
        described.robot,
        robots,
        scale=prior_stds(parameters) / np.array(steps),
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
