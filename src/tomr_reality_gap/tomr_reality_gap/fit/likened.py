"""Our simulation made like the user's: what theirs resists beyond ours is nothing reality adds.

Two simulators of one description differ a little: contacts that creep, rollers that knock. Torques
smooth in wheel speed, load and direction of travel are fitted to what a recording of the user's
simulation shows beyond ours. They resist in all that is simulated afterwards, held-out drives too.
"""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.noise import Local, noise_of, rows_of
from tomr_reality_gap.fit.probed import probed
from tomr_reality_gap.fit.study import Study
from tomr_reality_gap.mismatch.probes import Family, Motion

Array = NDArray[np.float64]

_WORTH = 0.006  # of the power's spread: what is less is not worth an inexact correction
_VARIABLES = ("signed wheel speed [rad/s]", "load current [sqrt W]", "direction of travel [rad]")


@frozen
class Likened:
    """Torques that a simulation has beyond ours."""

    families: tuple[Family, ...]
    turns: Array  # of all families' bumps, at each wheel [N m], (3, k)

    def torque(self, motion: Motion) -> Array:
        """What resists on a drive, at each wheel [N m], (n, 3)."""
        bumps = np.concatenate([family.torques(motion) for family in self.families])
        return np.asarray(np.einsum("wk,knw->nw", self.turns, bumps))


def likened(
    simulations: Sequence[RecordingSimulation], robot: Robot, torque: float
) -> Likened | None:
    """What simulations of a robot show beyond ours; None if that is next to nothing.

    Args:
        simulations: recordings of them.
        robot: as described.
        torque: typical of it [N m].
    """
    if not simulations:
        return None
    study = Study(tuple(simulations))
    nameless = probed(study, robot, torque, only=_VARIABLES)
    value, slope, _ = study.sloped(robot, (), np.empty(0))
    residual, nothing = study.value - value, np.zeros((len(study.value), 1))
    local = nameless.local
    weight = noise_of(study.channels, residual, nothing, value, slope, local).weight
    fitted = [
        solve(
            Gram.of(item.matrix, residual[item.rows], weight[item.rows]),
            range(item.matrix.shape[1]),
        )
        for item in local
    ]
    if _share(study, local, [item.mean for item in fitted]) < _WORTH:
        return None
    turns = np.stack([item.mean for item in fitted]) * nameless.size
    return Likened(nameless.families, np.broadcast_to(turns, (WHEELS, turns.shape[1])))


def _share(study: Study, local: Sequence[Local], turns: Sequence[Array]) -> float:
    """What torques add to the power drawn, over the power's spread, both pooled."""
    change = np.zeros_like(study.value)
    for item, turn in zip(local, turns, strict=True):
        change[item.rows] = item.matrix @ turn
    added, spread = 0.0, 0.0
    for channel, part in zip(study.channels, rows_of(study.channels), strict=True):
        if channel.kind in DRAWN_KINDS:
            added += float((change[part] ** 2).sum())
            spread += float(((study.value[part] - study.value[part].mean()) ** 2).sum())
    return float(np.sqrt(added / max(spread, 1e-300)))
