"""Models of the recordings brought to their best offsets with the simulator."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.gauss_newton import (
    GaussNewtonSettings,
    Linearisation,
    Start,
    maximise,
)
from tomr_power_model.estimation.noise import Noise
from tomr_power_model.estimation.parameter import bounds, prior_stds
from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.jacobian import Jacobian, linearise
from tomr_reality_gap.fit.model import Model

Array = NDArray[np.float64]
State = tuple[Model, Array]  # a model, and its sensor nuisances [prior standard deviations]

_LARGEST_STEP = 4.0  # prior standard deviations
_USUAL = GaussNewtonSettings()
# What trades places within a tolerance of what is found brings little, and by a narrow way.
_CLOSE = GaussNewtonSettings(most_steps=12, settled=0.02)
_ROUNDS = 3  # of new derivatives by the nuisances
_SAME = 1.0  # sum of squares by which another round is not worth while
_MOST_OFF = 4.0  # of a sensor nuisance: farther off it is a finding, and its column not linear


@frozen
class FittedModel:
    """A model at its best offsets."""

    model: Model
    evidence: float  # log, prior included; differences count
    chi2: float
    sensors: Array  # sensor nuisances [prior standard deviations]
    covariance: Array  # of nuisances, sensor nuisances, own parameters [prior std. deviations]
    value: Array  # simulated, sensor nuisances included, (n,)

    @property
    def own_sigma(self) -> Array:
        """Standard deviations of the hypotheses' parameters, in their units."""
        own = self.model.own
        sigma = np.sqrt(np.diag(self.covariance))[len(self.covariance) - len(own) :]
        return np.asarray(sigma * prior_stds(own))


def refine(
    dataset: Dataset,
    states: Sequence[State],
    jacobian: Jacobian,
    noise: Noise,
    *,
    tick: Tick,
    settings: GaussNewtonSettings = _USUAL,
) -> list[FittedModel]:
    """Each model at its best offsets; nuisances keep the derivatives of `jacobian`."""
    shared = _Shared.of(jacobian, noise)

    def evaluate(numbers: Sequence[int], units: Sequence[Array]) -> list[Linearisation]:
        moved = [
            state_at(states[number][0], at, jacobian)
            for number, at in zip(numbers, units, strict=True)
        ]
        points = _points(dataset, [model for model, _ in moved], tick)
        return [
            shared.linearised((dataset.value - value) * noise.weight, own, sensors)
            for (value, own), (_, sensors) in zip(points, moved, strict=True)
        ]

    found = []
    starts = [_start(model, sensors) for model, sensors in states]
    for (model, _), problem in zip(states, maximise(starts, evaluate, settings), strict=True):
        best = problem.best
        assert best is not None
        at, sensors = state_at(model, best.units, jacobian)
        prior = sum(item.log_prior for item in model.hypotheses)
        value = dataset.value - best.residual / noise.weight
        found.append(
            FittedModel(at, best.log_evidence + prior, best.chi2, sensors, best.covariance, value)
        )
    return found


def refined_at_itself(
    dataset: Dataset, fitted: FittedModel, noise: Noise, *, tick: Tick
) -> FittedModel:
    """A model at its best with the nuisances' derivatives taken there.

    Those at the description are good enough to compare models by, but where much was left out
    (a payload) they bend what it shares with a nuisance (the mass). The evidence stays that by
    which it was compared.
    """
    if not fitted.model.hypotheses:
        return fitted
    best = fitted
    for _ in range(_ROUNDS):
        jacobian = linearise(dataset, best.model, (), tick)
        before = best.chi2
        states = [(best.model, best.sensors)]
        (best,) = refine(dataset, states, jacobian, noise, tick=tick, settings=_CLOSE)
        if abs(before - best.chi2) < _SAME:
            break
    return evolve(best, evidence=fitted.evidence)


@frozen
class _Shared:
    """Whitened columns that all models share: nuisances and sensor nuisances."""

    columns: Array  # (n, q)
    information: Array  # (q, q)
    weight: Array  # (n,)
    sensors: slice

    @classmethod
    def of(cls, jacobian: Jacobian, noise: Noise) -> "_Shared":
        columns = jacobian.matrix[:, : jacobian.sensors.stop] * noise.weight[:, None]
        return cls(columns, columns.T @ columns, noise.weight, jacobian.sensors)

    def linearised(self, residual: Array, own: Array, sensors: Array) -> Linearisation:
        """A model, from its whitened residual without sensor nuisances, and its own columns."""
        residual = residual - self.columns[:, self.sensors] @ sensors
        own = own * self.weight[:, None]
        cross = self.columns.T @ own
        information = np.block([[self.information, cross], [cross.T, own.T @ own]])
        gradient = np.concatenate([self.columns.T @ residual, own.T @ residual])
        return Linearisation(residual, information, gradient)


def _start(model: Model, sensors: Array) -> Start:
    (low, high), (own_low, own_high) = bounds(model.nuisances), bounds(model.own)
    std, own_std = prior_stds(model.nuisances), prior_stds(model.own)
    edge = np.full(len(sensors), _MOST_OFF)
    lower = np.concatenate([low / std, -edge, own_low / own_std])
    upper = np.concatenate([high / std, edge, own_high / own_std])
    return Start(units_of(model, sensors), lower, upper, largest_steps(model, len(sensors)))


def _points(dataset: Dataset, models: Sequence[Model], tick: Tick) -> list[tuple[Array, Array]]:
    """Simulated values and derivatives by the models' own parameters (in prior_stds) of each."""
    robots, sizes = [], []
    for model in models:
        described = model.described
        steps = [
            parameter.step_at(offset)
            for parameter, offset in zip(model.own, model.own_offsets, strict=True)
        ]
        robots.append(described.robot)
        robots += [
            described.offset([parameter], [step]).robot
            for parameter, step in zip(model.own, steps, strict=True)
        ]
        sizes.append(prior_stds(model.own) / np.array(steps))
    values = dataset.predict(robots, tick)
    found, at = [], 0
    for size in sizes:
        part = values[at : (at := at + 1 + len(size))]
        found.append((part[0], (part[1:] - part[0]).T * size))
    return found


def largest_steps(model: Model, sensors: int) -> Array:
    """How far derivatives are good for [prior_stds]; a discrete alternative is no small step."""
    kept = [_LARGEST_STEP] * (len(model.nuisances) + sensors)
    return np.array([*kept, *(1.0 if p.discrete_offset else _LARGEST_STEP for p in model.own)])


def units_of(model: Model, sensors: Array) -> Array:
    """All offsets of a model in prior_stds: nuisances, sensor nuisances, own."""
    nuisance = np.array(model.nuisance_offsets) / prior_stds(model.nuisances)
    return np.concatenate([nuisance, sensors, model.own_offsets / prior_stds(model.own)])


def state_at(model: Model, units: Array, jacobian: Jacobian) -> State:
    """The model at other offsets [prior_stds], within its parameters' bounds."""
    first, last = jacobian.nuisance.stop, jacobian.sensors.stop
    nuisance = units[:first] * prior_stds(model.nuisances)
    own = units[last:] * prior_stds(model.own)
    return model.moved(nuisance, own), np.clip(units[first:last], -_MOST_OFF, _MOST_OFF)
