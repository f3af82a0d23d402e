"""Derivatives of the recordings' values by everything that a model and its additions can change."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import Noise
from tomr_power_model.estimation.parameter import prior_stds
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
    matrix: Array  # (n, p): nuisances, sensor nuisances, the model's own, candidates
    nuisance: slice
    sensors: slice  # sensor nuisances
    own: tuple[slice, ...]  # of each of the model's hypotheses
    candidates: Mapping[tuple[object, ...], slice]  # of each candidate, by its key

    @property
    def kept(self) -> int:
        """Columns of all but the candidates; they come first."""
        return self.own[-1].stop if self.own else int(self.sensors.stop)

    def whitened(self, noise: Noise, columns: slice | list[int]) -> Array:
        """Some columns over the noise's standard deviation."""
        return np.asarray(self.matrix[:, columns] * noise.weight[:, None])


def linearise(
    dataset: Dataset,
    model: Model,
    candidates: Sequence[Hypothesis],
    tick: Callable[[int], None] = lambda done: None,
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
    robots = [described.robot]
    robots += [described.offset([p], [s]).robot for p, s in zip(parameters, steps, strict=True)]
    for candidate in candidates if before is None else ():
        started = described.given(
            {key: at for key, at in candidate.start.items() if key not in described.values}
        )
        for parameter in candidate.sizes:
            step = parameter.discrete_offset or parameter.step
            robots.append(started.offset([parameter], [step]).robot)
            steps.append(step)
            parameters.append(parameter)
    values, time_derivative = dataset.with_time_derivative(robots, tick)
    matrix = ((values[1:] - values[0]).T / np.array(steps)) * prior_stds(parameters)
    sensors = dataset.sensor_nuisances(values[0], time_derivative)
    first, own = len(model.nuisances), len(model.own)
    if before is None:
        nuisance, mine, others = np.split(matrix, [first, first + own], axis=1)
    else:
        nuisance, mine = before.matrix[:, before.nuisance], matrix
        rows = [before.matrix[:, before.candidates[item.key]] for item in candidates]
        others = np.concatenate(rows, axis=1) if rows else np.empty((len(time_derivative), 0))
    edge = first + sensors.shape[1]
    parts, found = [], {}
    for hypothesis in model.hypotheses:
        parts.append(slice(edge, edge := edge + len(hypothesis.parameters)))
    for candidate in candidates:
        found[candidate.key] = slice(edge, edge := edge + len(candidate.sizes))
    return Jacobian(
        model,
        values[0],
        time_derivative,
        np.concatenate([nuisance, sensors, mine, others], axis=1),
        slice(0, first),
        slice(first, first + sensors.shape[1]),
        tuple(parts),
        found,
    )
