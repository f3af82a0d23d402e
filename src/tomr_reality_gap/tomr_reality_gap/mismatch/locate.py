"""Where a mismatch is: in which channels, over which variables, in which intervals."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import rows_of
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, Channel
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run
from tomr_reality_gap.explanation import Located, Map

Array = NDArray[np.float64]

_BINS = 12
_MOST_INTERVALS = 5
_HOLDS = 0.8  # of the energy: what a regime must hold
_NARROW = 0.6  # of the samples: a regime that needs more of them is none
_SMOOTH = 0.5  # s


def located(
    channels: Sequence[Channel],
    change: Array,
    weight: Array,
    share: float,
    *,
    variables: Mapping[str, Array],
) -> Located:
    """Where a change of the simulated values shows.

    Args:
        channels: that the rows belong to.
        change: what a finding does to each simulated value, (n,).
        weight: of each sample, (n,).
        share: of the mismatch that it explains.
        variables: of the motion at each sample, name with unit -> (n,).
    """
    energy = (change * weight) ** 2
    by_channel = {}
    for channel, part in zip(channels, rows_of(channels), strict=True):
        by_channel[channel.name] = float(energy[part].sum() / max(energy.sum(), 1e-300))
    time = np.concatenate([channel.time for channel in channels])
    return Located(share, _regime(energy, variables), _intervals(time, energy), by_channel)


def _regime(energy: Array, variables: Mapping[str, Array]) -> str:
    """The narrowest range of one variable that holds most of the energy, in words."""
    best, text = _NARROW, "throughout"
    total = energy.sum()
    if total <= 0.0:
        return text
    for name, values in variables.items():
        known = np.isfinite(values)
        order = np.argsort(values[known])
        ranked, energies = values[known][order], np.cumsum(energy[known][order]) / total
        if not len(ranked) or energies[-1] < _HOLDS:
            continue
        for low in (0.0, 0.1, 0.2):
            first = int(np.searchsorted(energies, low))
            last = int(np.searchsorted(energies, min(low + _HOLDS, energies[-1])))
            last = min(last, len(ranked) - 1)
            part = (last - first + 1) / len(ranked)
            if part < best:
                symbol, _, unit = name.partition(" [")
                best = part
                text = f"{ranked[first]:.3g} < {symbol} < {ranked[last]:.3g} {unit.rstrip(']')}"
    return text


def _intervals(time: Array, energy: Array) -> tuple[tuple[float, float], ...]:
    """The few intervals that hold most of the energy."""
    edges = np.arange(0.0, float(time.max()) + _SMOOTH, _SMOOTH)
    if len(edges) < 2:
        return ()
    held, _ = np.histogram(time, edges, weights=energy)
    order = np.argsort(-held)
    count = int(np.searchsorted(np.cumsum(held[order]), 0.5 * held.sum())) + 1
    marked = np.zeros(len(held), dtype=bool)
    marked[order[:count]] = True
    steps = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    found = [
        (float(edges[a]), float(edges[b])) for a, b in zip(steps[::2], steps[1::2], strict=True)
    ]
    found.sort(
        key=lambda pair: -float(held[(edges[:-1] >= pair[0]) & (edges[:-1] < pair[1])].sum())
    )
    return tuple(sorted(found[:_MOST_INTERVALS]))


def variables_at(
    simulation: RecordingSimulation, run: Run, channels: Sequence[Channel]
) -> dict[str, Array]:
    """Variables of the motion at each sample of a recording."""
    line = simulation.timeline
    time = np.concatenate([channel.time - 0.5 * channel.span for channel in channels])
    index = np.clip(((time - line.start) / line.period).astype(np.intp), 0, line.count - 1)
    wheel = np.concatenate(
        [np.full(len(c.time), -1 if c.wheel is None else c.wheel) for c in channels]
    )
    speed = run.speed
    own = np.where(wheel >= 0, speed[index, np.maximum(wheel, 0)], np.abs(speed[index]).max(axis=1))
    acceleration = np.gradient(speed, line.period, axis=0)
    hard = np.abs(acceleration[index]).max(axis=1)
    heading = np.cumsum(run.yaw_rate) * line.period
    return {
        "|omega| [rad/s]": np.abs(own),
        "omega [rad/s]": np.where(wheel >= 0, own, np.nan),
        "|acceleration| [rad/s^2]": hard,
        "time [s]": time,
        "heading [rad]": np.mod(heading[index] + np.pi, 2 * np.pi) - np.pi,
        "copper loss [W]": run.copper[index].sum(axis=1),
    }


def maps_of(
    channels: Sequence[Channel],
    before: Array,
    after: Array,
    sigma: Array,
    *,
    variables: Mapping[str, Array],
) -> tuple[Map, ...]:
    """Mean squares of whitened residuals over each variable, before and after: of each channel in
    all recordings together."""
    kept: dict[str, Array] = {}  # rows of each channel
    for channel, part in zip(channels, rows_of(channels), strict=True):
        if channel.kind in DRAWN_KINDS:
            own = np.arange(part.start, part.stop)
            kept[channel.name] = np.append(kept.get(channel.name, own[:0]), own)
    maps = []
    for name, values in variables.items():
        known = values[np.concatenate(list(kept.values()))] if kept else values[:0]
        known = known[np.isfinite(known)]
        if not len(known) or np.ptp(known) <= 0.0:
            continue
        low, high = float(np.quantile(known, 0.005)), float(np.quantile(known, 0.995))
        edges = np.linspace(low, high, _BINS + 1)
        rows = [
            [_binned(values[own], (left[own] / sigma[own]) ** 2, edges) for own in kept.values()]
            for left in (before, after)
        ]
        maps.append(Map(name, edges, tuple(kept), np.array(rows[0]), np.array(rows[1])))
    return tuple(maps)


def _binned(values: Array, squares: Array, edges: Array) -> Array:
    known = np.isfinite(values)
    count, _ = np.histogram(values[known], edges)
    total, _ = np.histogram(values[known], edges, weights=squares[known])
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
