"""Measured against simulated, before and after, and what that amounts to."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.explanation import Comparison, Score
from tomr_reality_gap.fit.noise import rows_of

Array = NDArray[np.float64]


def comparison(forward: Forward, before: Robot, after: Robot, held_out: bool) -> Comparison:
    """One recording with the robot as described and as explained."""
    values = forward.predict([before, after])
    rows = rows_of(forward.channels)
    run = forward.run(after)
    line = forward.timeline
    residual = np.concatenate([channel.value for channel in forward.channels]) - values[1]
    sigma = tuple(
        np.full(part.stop - part.start, 1.4826 * float(np.median(np.abs(residual[part]))) + 1e-9)
        for part in rows
    )
    return Comparison(
        name=forward.recorded.name,
        held_out=held_out,
        channels=forward.channels,
        before=tuple(values[0, part] for part in rows),
        after=tuple(values[1, part] for part in rows),
        sigma=sigma,
        speed=run["speed"],
        time=np.asarray(line.start + line.period * (np.arange(line.count) + 0.5)),
    )


def score_of(held: Sequence[Comparison]) -> Score | None:
    """Pooled over the motors' power of all held-out recordings; of the total without motors."""
    kinds = {channel.kind for item in held for channel in item.channels}
    kind = "power" if "power" in kinds else "total"
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
    return Score(nrmse[0], nrmse[1], accuracy[0], accuracy[1])
