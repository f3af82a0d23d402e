"""Pictures of the residuals: against what moves, their distribution, their whiteness."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tomr_power_model.canvas import AFTER, BEFORE, MEASURED, medians, png, scatter, sheet
from tomr_power_model.estimation.statistics import autocorrelation
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.explanation import Comparison

Array = NDArray[np.float64]

_SPREAD = 5.0  # standard deviations shown in a histogram
_LAGS = 40
_WHITE = 0.2  # shown of the autocorrelation at least, so that none looks like none


def shown_names(comparisons: Sequence[Comparison]) -> list[str]:
    """Channels to show: the powers, and without any all."""
    channels = {item.name: item.kind for one in comparisons for item in one.channels}
    powers = [name for name, kind in channels.items() if kind in DRAWN_KINDS]
    return powers or list(channels)


def residuals(comparisons: Sequence[Comparison], found: bool) -> str:
    """Measured - simulated against wheel speed, its rate and time; medians before and after.

    A motor's power is held against its own wheel, the robot's against the mean of all.
    """
    names = shown_names(comparisons)
    with sheet(len(names), 3, 2.1) as (page, panels):
        for row, name in enumerate(names):
            line = panels[3 * row : 3 * row + 3]
            over, before, after, unit = _against(comparisons, name)
            span = float(np.percentile(np.abs(before), 99.5)) or 1.0
            labels = ("wheel speed, rad/s", "acceleration, rad/s²", "time, s")
            for panel, variable, label in zip(line, over, labels, strict=True):
                scatter(panel, variable, after if found else before)
                medians(panel, variable, before, BEFORE)
                if found:
                    medians(panel, variable, after, AFTER)
                panel.axhline(0.0, color="black", lw=0.6)
                panel.set_ylim(-span, span)
                panel.set_xlabel(label if row == len(names) - 1 else "", fontsize=8)
            line[0].set_ylabel(f"{name}\nmeasured - simulated, {unit}", fontsize=8)
        return png(page)


def _against(
    comparisons: Sequence[Comparison], name: str
) -> tuple[tuple[Array, Array, Array], Array, Array, str]:
    """Speed, acceleration and time at a channel's samples; residual before and after; unit."""
    parts: list[tuple[Array, Array, Array, Array, Array]] = []
    unit = ""
    for one in comparisons:
        for number, channel in enumerate(one.channels):
            if channel.name != name:
                continue
            unit = channel.unit
            wheel = channel.wheel
            speed = one.speed[:, wheel] if wheel is not None else np.abs(one.speed).mean(axis=1)
            rate = np.gradient(speed, one.time)
            parts.append(
                (
                    np.interp(channel.time, one.time, speed),
                    np.interp(channel.time, one.time, rate),
                    channel.time,
                    channel.value - one.before[number],
                    channel.value - one.after[number],
                )
            )
    speed, rate, time, before, after = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return (speed, rate, time), before, after, unit


def whiteness(comparisons: Sequence[Comparison], found: bool) -> str:
    """Histogram of residual / sigma with the normal one, and its autocorrelation."""
    names = shown_names(comparisons)
    with sheet(len(names), 2, 1.8) as (page, panels):
        for row, name in enumerate(names):
            histogram, correlation = panels[2 * row], panels[2 * row + 1]
            sides = (("as described", BEFORE, False), ("as explained", AFTER, True))
            for label, colour, explained in sides[: 2 if found else 1]:
                series = _standard(comparisons, name, explained)
                _histogram(histogram, np.concatenate(series), colour, label)
                values = autocorrelation(series, _LAGS + 1)[1:]
                correlation.plot(range(1, _LAGS + 1), values, "-o", ms=2, lw=0.9, color=colour)
            samples = sum(len(item) for item in series)
            correlation.axhspan(*_chance(samples), color=MEASURED, alpha=0.3, lw=0)
            correlation.axhline(0.0, color="black", lw=0.6)
            low, high = correlation.get_ylim()
            correlation.set_ylim(min(low, -_WHITE), max(high, _WHITE))
            points = np.linspace(-_SPREAD, _SPREAD, 201)
            normal = np.exp(-0.5 * points**2) / np.sqrt(2.0 * np.pi)
            histogram.plot(points, normal, color="black", lw=0.8, label="normal")
            histogram.set_ylabel(f"{name}\ndensity", fontsize=8)
            correlation.set_ylabel("autocorrelation", fontsize=8)
        panels[0].legend(fontsize=7, framealpha=0.8)
        panels[-2].set_xlabel("residual, in units of noise (the ends: all beyond)", fontsize=8)
        panels[-1].set_xlabel("lag, samples (band: by chance)", fontsize=8)
        return png(page)


def _standard(comparisons: Sequence[Comparison], name: str, explained: bool) -> list[Array]:
    """Residual / sigma of one channel, recording by recording."""
    return [
        (channel.value - (one.after if explained else one.before)[number]) / one.sigma[number]
        for one in comparisons
        for number, channel in enumerate(one.channels)
        if channel.name == name
    ]


def _histogram(panel: Axes, standard: Array, colour: str, label: str) -> None:
    edges = np.linspace(-_SPREAD, _SPREAD, 61)
    counts, _ = np.histogram(np.clip(standard, -_SPREAD, _SPREAD), edges)
    density = counts / (max(1, len(standard)) * (edges[1] - edges[0]))
    panel.stairs(density, edges, color=colour, lw=1.0, label=label)


def _chance(samples: int) -> tuple[float, float]:
    """95 % of the autocorrelations of white noise."""
    half = 1.96 / np.sqrt(max(1, samples))
    return -half, half
