"""What the same estimate makes of the user's simulation, in which nothing is concealed.

Whatever size a finding has there is the difference of two simulators, not of simulation and
reality: it is taken off, and a finding of which half or more is so is none.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, Matrix, solve
from tomr_power_model.estimation.noise import Noise, rows_of
from tomr_power_model.estimation.parameter import prior_stds
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Tick
from tomr_reality_gap.fit.basis_responses import BasisResponses, own_rows
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import refine
from tomr_reality_gap.fit.unmodelled import Unmodelled
from tomr_reality_gap.mismatch.probes import motion_of

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

    def shows(self, unmodelled: Unmodelled, model: Model, basis: BasisResponses) -> bool:
        """Whether half of an effect without a name, or more, is in the simulation too."""
        robot, family = self.described, unmodelled.family
        motions = [motion_of(item, robot, item.run(robot)) for item in self.dataset.simulations]
        torques = [family.torques(motion) * basis.size for motion in motions]
        response = (self.dataset.respond(robot, torques) - self.dataset.predict([robot])[0]).T
        parts = []
        for wheel in unmodelled.wheels:
            rows = own_rows(self.dataset)[wheel]
            part = np.zeros_like(response)
            part[rows] = response[rows]
            parts.append(part)
        matrix = linearise(self.dataset, model, ()).matrix
        mean = self._fitted(np.concatenate([matrix, *parts], axis=1))
        weights = np.split(basis.size * mean[matrix.shape[1] :], len(parts))
        theirs = evolve(unmodelled, weights=tuple(weights))
        both = [
            np.concatenate([item.torque(motion).ravel() for motion in motions])
            for item in (theirs, unmodelled)
        ]
        return float(both[0] @ both[1]) > _HALF * float(both[1] @ both[1])

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
        worst = int(np.argmax(shares))
        last = found.rounds[-1]
        states = [(model.without(worst), found.best.sensors)]
        best = refine(dataset, states, last.jacobian, found.noise, tick=tick)[0]
        groups = found.alternatives
        found = evolve(found, best=best, alternatives=(*groups[:worst], *groups[worst + 1 :]))
