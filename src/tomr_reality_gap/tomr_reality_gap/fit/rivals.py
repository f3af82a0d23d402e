"""What the data can hardly distinguish from a finding, by calculation: the angle between responses.

What a finding shows, d, whitened, is explained as well by other columns B as the angle between d
and them is small, nuisances N and other findings projected out of both:

    loss of log likelihood = 1/2 |d|^2 sin^2(d, B)   beside N

So whatever spans nearly the same space is a rival, whether or not the search has tried it.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, solve, transposed_product
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.fit.screening import exclude_each_other
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

Array = NDArray[np.float64]

_WITHIN = 30.0  # log evidence, linearised: what comes as near is worth refining


@frozen
class Responses:
    """The columns of everything, at the last model that was searched from."""

    dataset: Dataset
    found: Selection
    candidates: Sequence[Hypothesis]

    @cached_property
    def _gram(self) -> Gram:
        matrix = self.found.rounds[-1].jacobian.matrix
        return Gram.of(matrix, np.zeros(len(matrix)), self.found.noise.weight)

    def nearest(self, best: FittedModel, *numbers: int) -> list[Model]:
        """Models in which another hypothesis stands in for one finding, or for two of them, in
        the place of the first; best first.
        """
        jacobian, weight = self.found.rounds[-1].jacobian, self.found.noise.weight
        number, *others = numbers
        kept = best.model.kept([at not in others for at in range(len(best.model.hypotheses))])
        fewer = kept.without(number)
        values = self.dataset.predict([best.model.described.robot, fewer.described.robot])
        lacking = (self.dataset.value - best.value + values[0] - values[1]) * weight
        vector = transposed_product(jacobian.matrix, lacking * weight)
        gram = Gram(self._gram.matrix, vector, float(lacking @ lacking))
        base = list(range(jacobian.sensors.stop))
        pairs = zip(jacobian.model.hypotheses, jacobian.own, strict=True)
        own = {**jacobian.candidates, **{item.key: part for item, part in pairs}}
        for hypothesis in fewer.hypotheses:
            base += self._rows(own.get(hypothesis.key))
        found: dict[str, tuple[float, Model]] = {}
        for item in self.candidates:
            rows = self._rows(own.get(item.key))[: len(item.sizes)]
            first = item.parameters[0]
            barred = item.name in best.model.names or first.discrete_offset or not rows
            if barred or any(exclude_each_other(item, other) for other in fewer.hypotheses):
                continue
            solved = solve(gram, [*base, *rows])
            sizes = (
                solved.mean[len(base) :] * [p.prior_std for p in item.sizes[: len(rows)]]
            ).tolist()
            evidence = solved.evidence + item.log_prior
            if not first.lower <= sizes[0] <= first.upper:
                continue
            if item.name not in found or evidence > found[item.name][0]:
                offsets = (*sizes, *(0.0,) * (len(item.parameters) - len(sizes)))
                found[item.name] = (evidence, kept.swapped(number, item, offsets))
        ranked = sorted(found.values(), key=lambda pair: -pair[0])
        return [model for evidence, model in ranked if evidence > ranked[0][0] - _WITHIN]

    def _rows(self, part: slice | None) -> list[int]:
        rows = [] if part is None else range(part.start, part.stop)
        return [row for row in rows if self._gram.matrix[row, row] > 0.0]
