"""Our simulation made like the user's: what theirs resists beyond ours is no reality gap.

Two simulators of one description differ a little: contacts that creep, rollers that knock. Torques
smooth in wheel speed, load and direction of travel are fitted to what a recording of the user's
simulation shows beyond ours. They resist in all that is simulated afterwards, on held-out drives
too.
"""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.estimation.linear_gaussian import Gram, solve
from tomr_power_model.estimation.noise import Local, noise_of, rows_of
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Motion
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.basis_responses import basis_responses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.mismatch.probes import Family

Array = NDArray[np.float64]

_VARIABLES = ("signed wheel speed [rad/s]", "motor current [A]", "direction of travel [rad]")


@frozen
class DiscrepancyTorques:
    """Torques that a simulation has beyond ours."""

    families: tuple[Family, ...]
    weights: Array  # of all families' basis functions, at each wheel [N m], (3, k)

    def torque(self, motion: Motion) -> Array:
        """What resists on a drive, at each wheel [N m], (n, 3)."""
        basis = np.concatenate([family.torques(motion) for family in self.families])
        return np.asarray(np.einsum("wk,knw->nw", self.weights, basis))


def discrepancy_torques(
    simulations: Sequence[RecordingSimulation], robot: Robot, torque: float
) -> DiscrepancyTorques | None:
    """What simulations of a robot show beyond ours; None if that is next to nothing.

    Args:
        simulations: recordings of them.
        robot: as described.
        torque: typical of it [N m].
    """
    if not simulations:
        return None
    dataset = Dataset(tuple(simulations))
    basis = basis_responses(dataset, robot, torque, only=_VARIABLES)
    value, time_derivative = dataset.with_time_derivative(robot, (), scale=np.empty(0), into=())
    residual, nothing = dataset.value - value, np.zeros((len(dataset.value), 1))
    local = basis.local
    weight = noise_of(
        dataset.channels, residual, nothing, value, time_derivative=time_derivative, local=local
    ).weight
    fitted = [
        solve(
            Gram.of(item.matrix, residual[item.rows], weight[item.rows]),
            range(item.matrix.shape[1]),
        )
        for item in local
    ]
    if _share(dataset, local, [item.mean for item in fitted]) < SIMULATOR.torque:
        return None
    weights = np.stack([item.mean for item in fitted]) * basis.size
    return DiscrepancyTorques(basis.families, np.broadcast_to(weights, (WHEELS, weights.shape[1])))


def _share(dataset: Dataset, local: Sequence[Local], weights: Sequence[Array]) -> float:
    """What torques add to the power drawn, over the power's standard deviation, both pooled."""
    change = np.zeros_like(dataset.value)
    for item, weight in zip(local, weights, strict=True):
        change[item.rows] = item.matrix @ weight
    added, varies = 0.0, 0.0
    for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True):
        if channel.kind in DRAWN_KINDS:
            added += float((change[part] ** 2).sum())
            varies += float(((dataset.value[part] - dataset.value[part].mean()) ** 2).sum())
    return float(np.sqrt(added / max(varies, 1e-300)))
