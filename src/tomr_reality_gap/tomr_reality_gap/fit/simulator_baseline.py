"""What the same estimate makes of the user's simulation, in which nothing is concealed.

Whatever size a finding has there is the difference of two simulators, not of simulation and
reality: it is taken off, and a finding of which half or more is so is none.
"""

from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, Matrix, product, solve
from tomr_power_model.estimation.noise import Noise, rows_of
from tomr_power_model.estimation.parameter import prior_stds
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Tick
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.significance import dropped
from tomr_reality_gap.fit.unmodelled import Unmodelled

Array = NDArray[np.float64]
Offsets = tuple[tuple[float, ...], ...]  # of each hypothesis' parameters

_HALF = 0.5  # of a finding


@frozen
class SimulatorBaseline:
    """Recordings of the user's simulation, weighed as the real ones are."""

    dataset: Dataset
    weight: Array  # (n,)
    described: Robot
    residual: Array = field(init=False)  # recorded - ours, as described, (n,)

    def __attrs_post_init__(self) -> None:
        value = self.dataset.predict([self.described])[0]
        object.__setattr__(self, "residual", self.dataset.value - value)

    @classmethod
    def of(
        cls,
        simulations: Sequence[RecordingSimulation],
        real: Dataset,
        noise: Noise,
        described: Robot,
    ) -> "SimulatorBaseline | None":
        """None without simulations; noise is that of the real recordings."""
        if not simulations:
            return None
        usual = {
            channel.name: float(np.median(noise.weight[part]))
            for channel, part in zip(real.channels, rows_of(real.channels), strict=True)
        }
        dataset = Dataset(tuple(simulations))
        weight = np.concatenate(
            [np.full(len(item.time), usual.get(item.name, 0.0)) for item in dataset.channels]
        )
        return cls(dataset, weight, described)

    def offsets(self, model: Model) -> Offsets:
        """Offsets that a model's hypotheses have in the simulation, all else fitted with them."""
        jacobian = linearise(self.dataset, model, ())
        mean = self._fitted(jacobian.matrix)
        return tuple(
            tuple((mean[part] * prior_stds(hypothesis.parameters)).tolist())
            for part, hypothesis in zip(jacobian.own, model.hypotheses, strict=True)
        )

    def shows(self, unmodelled: Unmodelled) -> bool:
        """Whether half of an effect without a name, or more, is in the simulation too."""
        robot, table, term = self.described, unmodelled.table, unmodelled.learnt
        motions = [motion_in(item, robot) for item in self.dataset.simulations]
        parts = table.columns(self.dataset, robot, motions)
        chosen = [parts[number] for number in table.rows_of(term)]
        columns = np.concatenate(chosen, axis=1)
        theirs = product(columns, self._fitted(columns)) * self.weight
        ours = product(columns, table.units_of(term).ravel()) * self.weight
        return float(theirs @ ours) > _HALF * float(ours @ ours)

    def _fitted(self, columns: Matrix) -> Array:
        gram = Gram.of(columns, self.residual, self.weight)
        return solve(gram, range(columns.shape[1])).mean


def beyond_baseline(
    dataset: Dataset,
    found: Selection,
    baseline: SimulatorBaseline | None,
    tick: Tick = lambda done: None,
) -> tuple[Selection, Offsets]:
    """Findings that the simulation does not show as well, and what it shows of each of them."""
    nothing = tuple((0.0,) * len(offsets) for offsets in found.best.model.offsets)
    if baseline is None or not found.best.model.hypotheses:
        return found, nothing
    while True:
        model = found.best.model
        theirs = baseline.offsets(model)
        shares = [
            other[0] / offsets[0] if offsets[0] else 0.0
            for other, offsets in zip(theirs, model.offsets, strict=True)
        ]
        if not shares or max(shares) < _HALF:
            return found, theirs
        found = dropped(dataset, found, int(np.argmax(shares)), tick)
