"""All that a verdict rests on, and what it could not have seen."""

import math
from functools import cached_property

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.effects.scales import Scales
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import Run
from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.mirrored import Mirror, Turns
from tomr_reality_gap.fit.probed import Probed
from tomr_reality_gap.fit.search import Found, finding_cost
from tomr_reality_gap.fit.study import Columns, Study
from tomr_reality_gap.hypotheses.knobs import Hypothesis, Knob, Turned

Array = NDArray[np.float64]

_LISTED = 12  # smallest sizes that are told


@frozen
class Evidence:
    """All that a verdict rests on."""

    study: Study
    found: Found
    base: Turned
    robot: Robot  # as described
    source: str  # robot.yaml
    scales: Scales
    candidates: tuple[Hypothesis, ...]
    nameless: Probed
    mirror: Mirror | None = None
    shared: Turns = ()  # what the user's simulation shows of each finding

    @cached_property
    def simulated(self) -> tuple[Array, ...]:
        """Values of the robot as described, of the best model, and of that without each finding."""
        model = self.found.best.model
        fewer = [model.without(number) for number in range(len(model.hypotheses))]
        robots = [item.described.robot for item in (model, *fewer)]
        return tuple(self.study.predict([self.base.robot, *robots]))

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """Motion of the best model in each recording."""
        robot = self.found.best.model.described.robot
        return tuple(item.run(robot) for item in self.study.simulations)


def smallest(evidence: Evidence) -> tuple[tuple[str, str, str], ...]:
    """The smallest size of each effect that would have been found."""
    step = evidence.found.rounds[-1]
    columns: Columns = step.columns
    weight = step.noise.weight
    gram = Gram.of(columns.matrix, np.zeros(len(weight)), weight)
    base = list(range(columns.instruments.stop))
    inverse = solve(gram, base).covariance
    found: dict[str, tuple[float, Hypothesis, Knob]] = {}
    open_ones = [h for h in evidence.candidates if h.name not in columns.model.names]
    for hypothesis in open_ones:
        row = columns.candidates[hypothesis.key].start
        cross = gram.matrix[row, base]
        information = gram.matrix[row, row] - float(cross @ inverse @ cross)
        if information <= 0.0 or hypothesis.effect.startswith("parameter."):
            continue
        knob = hypothesis.knobs[0]
        size = knob.spread * math.sqrt(
            2.0 * (finding_cost(evidence.study) + math.log1p(information)) / information
        )
        size = max(size, hypothesis.least)
        best = found.get(hypothesis.name)
        if best is None or size < best[0]:
            found[hypothesis.name] = (size, hypothesis, knob)
    rows = [
        (item.effect, ", ".join(item.where), f"{knob.name} {size:.2g} {knob.unit}".rstrip())
        for size, item, knob in found.values()
        if item.where[0] in ("all_wheels", "body", "supply")
    ]
    return tuple(rows[: 2 * _LISTED])
