"""All that a verdict rests on, and what it could not have seen."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, solve
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot
from tomr_power_model.robot import Robot
from tomr_power_model.unmodelled import LearntTerm
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run
from tomr_reality_gap.fit.basis_responses import BasisResponses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection, finding_cost
from tomr_reality_gap.fit.jacobian import Jacobian, linearise
from tomr_reality_gap.fit.learnt import with_terms
from tomr_reality_gap.fit.simulator_baseline import Offsets
from tomr_reality_gap.fit.structure import additions_of, structural_shifts
from tomr_reality_gap.fit.uncertainty import own_sigma
from tomr_reality_gap.fit.unmodelled import Unmodelled
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.rules import Residuals

Array = NDArray[np.float64]

_LISTED = 24  # detection limits that are reported


@frozen
class AnalysisResult:
    """All that a verdict rests on."""

    dataset: Dataset  # simulated with the unnamed term, if there is one
    found: Selection
    base: ParameterisedRobot
    robot: Robot  # as described
    source: str  # robot.yaml
    candidates: tuple[Hypothesis, ...]
    basis: BasisResponses
    shared: Offsets = ()  # what the user's simulation shows of each finding
    plain: Dataset | None = None  # without the unnamed term; None: there is none
    unmodelled: Unmodelled | None = None
    spoils: bool = False  # held-out drives are predicted worse with the unnamed term

    @property
    def term(self) -> LearntTerm | None:
        """What is unnamed and expected of other drives; None: nothing that they repeat."""
        effect = self.unmodelled
        return None if effect is None or self.spoils or not effect.is_repeatable else effect.term

    @cached_property
    def simulated(self) -> tuple[Array, ...]:
        """Values of the robot as described, of the best model, and of that without each finding."""
        model = self.found.best.model
        fewer = [model.without(number) for number in range(len(model.hypotheses))]
        robots = [item.described.robot for item in (model, *fewer)]
        described = (self.plain or self.dataset).predict([self.base.robot])
        return (*described, *self.dataset.predict(robots))

    @cached_property
    def jacobian(self) -> Jacobian:
        """Of the best model."""
        return linearise(self.dataset, self.found.best.model, ())

    @cached_property
    def own_sigma(self) -> Array:
        """Standard deviations of the parameters of the best model's hypotheses, in their units."""
        return own_sigma(self.dataset, self.found, self.jacobian)

    @cached_property
    def structural_shifts(self) -> Array:
        """How far these may be off for what shows and has no name, in their units."""
        offsets = np.array(self.found.best.model.own_offsets)
        added = additions_of(self.dataset, self.found, self.jacobian, self.candidates)
        return structural_shifts(tuple(added), offsets)

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """Motion of the best model in each recording."""
        robot = self.found.best.model.described.robot
        return tuple(item.run(robot) for item in self.dataset.simulations)


def residuals_of(dataset: Dataset, before: Array, after: Array) -> list[Residuals]:
    """Of what is drawn and of speeds, channel by channel, from simulated values, (n,) each."""
    return [
        Residuals(
            channel.value - before[part],
            channel.value - after[part],
            float(np.std(channel.value)),
            channel.kind in DRAWN_KINDS,
            channel.quantum,
            channel.rounding(after[part]),
        )
        for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True)
        if channel.kind in (*DRAWN_KINDS, "speed")
    ]


def spoils(analysis: AnalysisResult, held: Sequence[RecordingSimulation]) -> bool:
    """Whether the unnamed term leaves more of what is drawn in held-out drives than there is.

    A map of the floor knows nothing of places where nobody has been, however smooth it is.
    """
    if analysis.term is None:
        return False
    robot, left = analysis.found.best.model.described.robot, np.zeros(2)
    for item in held:
        for row, terms in enumerate(((), (analysis.term,))):
            value = with_terms(item, robot, terms).predict([robot])[0]
            for channel, part in zip(item.channels, rows_of(item.channels), strict=True):
                if channel.kind in DRAWN_KINDS:
                    spread = max(float(np.std(channel.value)), 1e-12)
                    left[row] += float(np.sum(((channel.value - value[part]) / spread) ** 2))
    return bool(left[1] > left[0])


def detection_limits(analysis: AnalysisResult) -> tuple[tuple[str, str, str], ...]:
    """The smallest size of each effect that would have been found."""
    step = analysis.found.rounds[-1]
    jacobian, noise = step.jacobian, step.noise
    samples = len(noise.weight)
    gram = Gram.of(jacobian.matrix, np.zeros(samples), noise.weight)
    cost = finding_cost(samples)
    base = list(range(jacobian.sensors.stop))
    inverse = solve(gram, base).covariance
    found: dict[str, tuple[float, Hypothesis, Parameter]] = {}
    open_ones = [h for h in analysis.candidates if h.name not in jacobian.model.names]
    for hypothesis in open_ones:
        row = jacobian.candidates[hypothesis.key].start
        cross = gram.matrix[row, base]
        information = gram.matrix[row, row] - float(cross @ inverse @ cross)
        if information <= 0.0 or hypothesis.effect.startswith("parameter."):
            continue
        parameter = hypothesis.parameters[0]
        size = parameter.prior_std * math.sqrt(2.0 * (cost + math.log1p(information)) / information)
        size = max(size, hypothesis.least)
        best = found.get(hypothesis.name)
        if best is None or size < best[0]:
            found[hypothesis.name] = (size, hypothesis, parameter)
    rows = [
        (item.effect, ", ".join(item.where), f"{first.name} {size:.2g} {first.unit}".rstrip())
        for size, item, first in found.values()
        if item.where[0] in ("all_wheels", "body", "supply")
    ]
    return tuple(rows[:_LISTED])
