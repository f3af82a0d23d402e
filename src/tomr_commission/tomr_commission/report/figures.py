"""Pictures of a commissioning, as PNG for embedding in a page."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_commission.alarm import Tail
from tomr_commission.bands import KINDS
from tomr_commission.commission import Commissioned
from tomr_commission.evidence import MOST_CAUTION, SURE
from tomr_commission.observed import Observed, band_of
from tomr_power_model.canvas import AFTER, BEFORE, MEASURED, png, sheet

Array = NDArray[np.float64]

_COLOURS = (AFTER, BEFORE)
_SMOOTH = 200
_PAUSE = 1.0  # s between drives that are drawn one after the other


def alarm_picture(found: Commissioned) -> str:
    """How often an hour evidence exceeds a level: peaks, fitted tails, and the level chosen."""
    level = found.outcome.level
    with sheet(1, 1, 3.2) as (drawing, (panel,)):
        for tail, colour in zip(level.tails, _COLOURS, strict=False):
            _tail(panel, tail, colour)
        panel.axhline(level.wanted, color=MEASURED, lw=0.8, ls="--")
        panel.annotate("asked for", (0.0, level.wanted), fontsize=7, va="bottom", color=MEASURED)
        panel.axvline(level.caution + SURE, color="#15803d", lw=1.5)
        panel.annotate(
            "alarm",
            (level.caution + SURE, 1.0),
            xycoords=("data", "axes fraction"),
            fontsize=8,
            va="top",
            color="#15803d",
        )
        panel.set_yscale("log")
        panel.yaxis.set_major_formatter("{x:g}")
        panel.set_xlim(0.0, MOST_CAUTION + SURE + 2.0)
        panel.set_ylim(bottom=min(level.wanted, 0.01) / 10.0)
        panel.set_xlabel("evidence for a fault, decades")
        panel.set_ylabel("peaks beyond, per hour", fontsize=8)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize=8, loc="upper right")
        return png(drawing)


def _tail(panel: object, tail: Tail, colour: str) -> None:
    if not tail.above:
        return
    each = tail.events_per_hour / tail.events
    counted = each * np.arange(1, len(tail.peaks) + 1)
    grid = np.linspace(tail.threshold, MOST_CAUTION + SURE, _SMOOTH)
    panel.plot(tail.peaks, counted, ".", color=colour, label=tail.source)  # type: ignore[attr-defined]
    rates = [tail.rate(float(at)) for at in grid]
    panel.plot(grid, rates, color=colour, lw=1.2, label="its tail")  # type: ignore[attr-defined]
    highs = [float(np.quantile(tail.draws(float(at)), 0.975)) for at in grid]
    panel.plot(grid, highs, color=colour, lw=0.8, ls=":", label="its 95 % upper end")  # type: ignore[attr-defined]


def held_picture(found: Commissioned) -> str:
    """Residuals of the drives held out over their bands, one drive after the other."""
    drives = found.outcome.held
    times = end_to_end(drives)
    with sheet(len(KINDS), 1, 1.3) as (drawing, panels):
        for panel, (kind, channels) in zip(panels, KINDS.items(), strict=True):
            for drive, time in zip(drives, times, strict=True):
                ratio = drive.residual / band_of(drive, found.outcome.bands)
                for number, channel in enumerate(channels):
                    panel.plot(time, ratio[:, channel], lw=0.6, color=f"C{number}")
            panel.axhspan(-1.0, 1.0, color="#dcfce7", zorder=0)
            panel.set_ylim(-2.5, 2.5)
            panel.set_ylabel(kind.replace(", ", ",\n") + "\nbands", fontsize=6)
        panels[-1].set_xlabel("s")
        return png(drawing)


def end_to_end(drives: Sequence[Observed]) -> list[Array]:
    """Times [s] at which drives are drawn, one after the other with a pause between."""
    ends = np.cumsum([drive.seconds[-1] + _PAUSE for drive in drives])
    return [
        end - _PAUSE - drive.seconds[-1] + drive.seconds
        for drive, end in zip(drives, ends, strict=True)
    ]
