"""Measured against simulated, before and after, and what that amounts to."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import robust_scale
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run
from tomr_reality_gap.explanation import Comparison, Score
from tomr_reality_gap.mismatch.probes import Motion, motion_of

Array = NDArray[np.float64]


def simulated(
    simulation: RecordingSimulation,
    before: Robot,
    after: Robot,
    besides: Callable[[Motion], Array] | None,
) -> tuple[Array, Run]:
    """Values before and after, (2, n), and the motion of `RecordingSimulation.run` after.

    `besides` are torques at the wheels that no robot's description holds.
    """
    run = simulation.run(after)
    values = simulation.predict([before, after])
    if besides is not None:
        torque = besides(motion_of(simulation, after, run))
        values[1] = next(simulation.respond(after, torque[None]))
    return values, run


def comparison(
    simulation: RecordingSimulation,
    values: Array,
    run: Run,
    *,
    is_held_out: bool,
    noise: Mapping[str, float] = MappingProxyType({}),
) -> Comparison:
    """One recording, simulated before and after, (2, n).

    Args:
        simulation: of the recording.
        values: of all its channels, before and after.
        run: of `simulation.run` after.
        is_held_out: whether nothing was fitted to it.
        noise: standard deviation by channel; of others it is taken from what is left after.
    """
    rows = rows_of(simulation.channels)
    sigma = tuple(
        noise.get(channel.name, robust_scale(channel.value - values[1, part]) + 1e-9)
        for channel, part in zip(simulation.channels, rows, strict=True)
    )
    return Comparison(
        name=simulation.recorded.name,
        held_out=is_held_out,
        channels=simulation.channels,
        before=tuple(values[0, part] for part in rows),
        after=tuple(values[1, part] for part in rows),
        sigma=sigma,
        speed=run.speed,
        time=simulation.timeline.middle,
    )


def score_of(held: Sequence[Comparison]) -> Score | None:
    """Pooled over the motors of all held-out recordings; of the total where none is measured."""
    kinds = {channel.kind for item in held for channel in item.channels}
    kind = next((kind for kind in DRAWN_KINDS if kind in kinds), None)
    measured, before, after, spread = [], [], [], []
    for item in held:
        for channel, first, last in zip(item.channels, item.before, item.after, strict=True):
            if channel.kind == kind:
                measured.append(channel.value)
                before.append(channel.value - first)
                after.append(channel.value - last)
                spread.append(channel.value - channel.value.mean())
    if not measured:
        return None
    total = np.abs(np.concatenate(measured)).sum()
    deviation = np.sqrt(np.mean(np.concatenate(spread) ** 2))
    errors = [np.concatenate(part) for part in (before, after)]
    nrmse = [float(np.sqrt(np.mean(error**2)) / deviation) for error in errors]
    accuracy = [float(1.0 - np.abs(error).sum() / total) for error in errors]
    quantity = "motor current [A]" if kind == "current" else "power [W]"
    return Score(nrmse[0], nrmse[1], accuracy[0], accuracy[1], quantity)
