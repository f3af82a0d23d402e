"""Pictures of an explanation: what was measured, simulated before, and simulated after."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tomr_power_model.canvas import (
    AFTER,
    BEFORE,
    MEASURED,
    PLACE,
    broken,
    png,
    sheet,
    smooth,
)
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.explanation import Comparison, Explanation, Map
from tomr_reality_gap.report.showing import View, leading

Array = NDArray[np.float64]

_BLOCKS = 150  # of the strip over a whole recording
_SMOOTHED = 60  # points of a running mean in a zoomed window
_NARROW, _WIDE = 0.7, 1.3
_MOST_PANELS = 4  # channels of a map
_ABOVE: Mapping[str, Any] = MappingProxyType(  # a legend that hides nothing
    {
        "loc": "lower right",
        "bbox_to_anchor": (1.0, 1.0),
        "borderaxespad": 0.1,
        "fontsize": 8,
        "ncols": 3,
        "frameon": False,
    }
)


def show(view: View, explanation: Explanation) -> str:
    """The channel that matters: over the whole recording, and zoomed."""
    finding = leading(explanation)
    with sheet(3, 1, 2.0, heights=(0.7, 1.3, 1.0)) as (page, panels):
        _strip(panels[0], view, finding is not None)
        if finding is not None:
            for start, end in finding.located.intervals:
                panels[0].axvspan(start, end, color=PLACE, alpha=0.6, lw=0, zorder=0)
        for edge in view.window:
            panels[0].axvline(edge, color="black", lw=0.7, ls=":")
        _zoom(panels[1], view, finding is not None)
        _difference(panels[2], view, finding is not None)
        return png(page)


def _rows(view: View) -> NDArray[np.bool_]:
    time = view.comparison.channels[view.channel].time
    return (time >= view.window[0]) & (time <= view.window[1])


def _strip(panel: Axes, view: View, found: bool) -> None:
    """RMS of the residual in units of its noise, block by block."""
    channel = view.comparison.channels[view.channel]
    edges = np.linspace(channel.time[0], channel.time[-1] + 1e-9, _BLOCKS + 1)
    block = np.digitize(channel.time, edges) - 1
    count = np.bincount(block, minlength=_BLOCKS)[:_BLOCKS]
    for label, colour, simulated in _sides(view.comparison, view.channel, found):
        standard = (channel.value - simulated) / view.comparison.sigma[view.channel]
        square = np.bincount(block, standard**2, minlength=_BLOCKS)[:_BLOCKS]
        with np.errstate(invalid="ignore", divide="ignore"):
            level = np.sqrt(square / count)
        panel.stairs(level, edges, color=colour, lw=1.0, label=label, baseline=None)
    panel.axhline(1.0, color="black", lw=0.6)
    panel.set_xlim(edges[0], edges[-1])
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel("RMS residual,\nin units of noise", fontsize=8)
    panel.set_title(
        f"{view.name}: the whole recording (shaded: where the effect shows; dotted: zoomed below)"
        if found
        else f"{view.name}: the whole recording (dotted: zoomed below)",
        fontsize=9,
        loc="left",
    )


def _sides(comparison: Comparison, number: int, found: bool) -> list[tuple[str, str, Array]]:
    """Simulations to draw: (label, colour, values)."""
    before = "simulated as described", BEFORE, comparison.before[number]
    if not found:
        return [before]
    return [before, ("simulated as explained", AFTER, comparison.after[number])]


def _zoom(panel: Axes, view: View, found: bool) -> None:
    channel, rows = view.comparison.channels[view.channel], _rows(view)
    time = channel.time[rows]
    panel.plot(*broken(time, channel.value[rows]), color=MEASURED, lw=_WIDE + 0.7, label="measured")
    for label, colour, simulated in _sides(view.comparison, view.channel, found):
        panel.plot(*broken(time, simulated[rows]), color=colour, lw=_NARROW + 0.3, label=label)
    panel.legend(**_ABOVE)
    panel.set_xlim(view.window)
    panel.tick_params(labelbottom=False)
    panel.set_ylabel(f"{view.name}\n{channel.unit}", fontsize=8)


def _difference(panel: Axes, view: View, found: bool) -> None:
    """Measured - simulated: samples faint, their running mean bold, the noise as a band."""
    channel, rows = view.comparison.channels[view.channel], _rows(view)
    time, sigma = channel.time[rows], view.comparison.sigma[view.channel]
    over = max(1, len(time) // _SMOOTHED)
    panel.fill_between(time, -2 * sigma, 2 * sigma, color=MEASURED, alpha=0.2, lw=0)
    for _, colour, simulated in _sides(view.comparison, view.channel, found):
        rest = channel.value[rows] - simulated[rows]
        if over > 1:
            panel.plot(*broken(time, rest), color=colour, lw=0.5, alpha=0.3)
        panel.plot(*broken(time, smooth(rest, over)), color=colour, lw=_WIDE)
    panel.axhline(0.0, color="black", lw=0.6)
    panel.set_xlim(view.window)
    panel.set_ylabel(f"measured - simulated\n{channel.unit}", fontsize=8)
    panel.set_xlabel("s (band: 95 % of the noise)", fontsize=8)


def over_time(comparison: Comparison, found: bool) -> str:
    """All power channels of a recording with their residuals; without any all channels."""
    numbers = [n for n, item in enumerate(comparison.channels) if item.kind in DRAWN_KINDS]
    numbers = numbers or list(range(len(comparison.channels)))
    with sheet(2 * len(numbers), 1, 1.1, heights=(1.3, 0.7) * len(numbers)) as (page, panels):
        for row, number in enumerate(numbers):
            channel = comparison.channels[number]
            values, rest = panels[2 * row], panels[2 * row + 1]
            values.plot(
                *broken(channel.time, channel.value), color=MEASURED, lw=_WIDE, label="measured"
            )
            for label, colour, simulated in _sides(comparison, number, found):
                values.plot(*broken(channel.time, simulated), color=colour, lw=_NARROW, label=label)
                left = channel.value - simulated
                rest.plot(*broken(channel.time, left), color=colour, lw=_NARROW)
            rest.axhline(0.0, color="black", lw=0.6)
            values.set_ylabel(f"{channel.name}\n{channel.unit}", fontsize=8)
            rest.set_ylabel(f"residual\n{channel.unit}", fontsize=8)
            for panel in (values, rest):
                panel.set_xlim(channel.time[0], channel.time[-1])
        panels[0].legend(**_ABOVE)
        panels[-1].set_xlabel("s", fontsize=8)
        for panel in panels[:-1]:
            panel.tick_params(labelbottom=False)
        return png(page)


def map_weight(item: Map, found: bool) -> float:
    """How unevenly over its variable the mismatch lies that was explained, or lies there."""
    return max((float(np.nanstd(gain)) for gain in _gains(item, found).values()), default=0.0)


def _gains(item: Map, found: bool) -> dict[int, Array]:
    """RMS residual less what is left of it, in units of noise; of the channels with data."""
    return {
        number: np.sqrt(before) - (np.sqrt(item.after[number]) if found else 1.0)
        for number, before in enumerate(item.before)
        if np.isfinite(before).any()
    }


def map_picture(item: Map, found: bool) -> str:
    """Mismatch over one variable, channel by channel."""
    gains = _gains(item, found)
    known = sorted(gains, key=lambda n: -float(np.nanmax(gains[n])))[:_MOST_PANELS]
    with sheet(1, max(1, len(known)), 2.2) as (page, panels):
        for panel, number in zip(panels, sorted(known), strict=False):
            for label, colour, square in (
                ("as described", BEFORE, item.before[number]),
                ("as explained", AFTER, item.after[number]),
            )[: 2 if found else 1]:
                panel.stairs(
                    np.sqrt(square), item.edges, color=colour, lw=1.2, baseline=None, label=label
                )
            panel.axhline(1.0, color="black", lw=0.6)
            panel.set_ylim(bottom=0.0)
            panel.set_title(item.channels[number], fontsize=8, loc="left")
            panel.set_xlabel(item.variable, fontsize=8)
        panels[0].set_ylabel("RMS residual, in units of noise", fontsize=8)
        panels[0].legend(fontsize=7, framealpha=0.8)
        return png(page)
