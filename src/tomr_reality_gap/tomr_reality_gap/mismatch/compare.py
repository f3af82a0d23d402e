"""Measured against simulated, before and after, and what that amounts to."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import robust_scale
from tomr_power_model.model.scores import accuracy
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run
from tomr_reality_gap.explanation import Comparison, Score

Array = NDArray[np.float64]


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
    rows = [
        (channel.value, old, new, channel.value - channel.value.mean())
        for item in held
        for channel, old, new in zip(item.channels, item.before, item.after, strict=True)
        if channel.kind == kind
    ]
    if not rows:
        return None
    value, before, after, spread = (np.concatenate(part) for part in zip(*rows, strict=True))
    deviation = np.sqrt(np.mean(spread**2))
    first, last = (
        float(np.sqrt(np.mean((value - item) ** 2)) / deviation) for item in (before, after)
    )
    quantity = "motor current [A]" if kind == "current" else "power [W]"
    return Score(first, last, accuracy(value, before), accuracy(value, after), quantity)
