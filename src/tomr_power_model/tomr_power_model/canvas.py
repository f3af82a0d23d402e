"""Sheets of panels of one style, as PNG for embedding in a page."""

import base64
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period

Array = NDArray[np.float64]

MEASURED, BEFORE, AFTER, PLACE = "#8a8f98", "#c2410c", "#1d4ed8", "#fde68a"
_BREAK = 3.0  # usual periods without a sample: the line is broken
_BINS = 24
_LEAST_IN_BIN = 8
_MOST_DOTS = 6000


@contextmanager
def sheet(
    rows: int, columns: int, height: float, heights: Sequence[float] | None = None
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure of so many panels, each `height` inches high on the average."""
    # Names of recordings and wheels are no formulae.
    with rc_context({"text.parse_math": False}):
        page = Figure(figsize=(10.0, height * rows + 0.4), dpi=110, layout="constrained")
        panels = list(page.subplots(rows, columns, squeeze=False, height_ratios=heights).ravel())
        for panel in panels:
            panel.grid(alpha=0.25, lw=0.5)
            panel.tick_params(labelsize=7)
            panel.spines[["top", "right"]].set_visible(False)
        yield page, panels


def png(page: Figure) -> str:
    """The figure as a data URL."""
    buffer = BytesIO()
    page.savefig(buffer, format="png")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def broken(time: Array, values: Array) -> tuple[Array, Array]:
    """A line over time, broken where samples are missing."""
    if len(time) < 3:
        return time, values
    gaps = np.flatnonzero(np.diff(time) > _BREAK * median_period(time)) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)


def smooth(values: Array, over: int) -> Array:
    """Running mean over so many samples, fewer at the ends."""
    if over < 2 or not len(values):
        return values
    kernel = np.ones(min(over, len(values)))
    return np.asarray(
        np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same")
    )


def scatter(panel: Axes, over: Array, values: Array) -> None:
    """A dot for each sample, of many samples for some."""
    step = max(1, len(over) // _MOST_DOTS)
    panel.plot(over[::step], values[::step], ".", ms=1.2, color=MEASURED, alpha=0.3)


def medians(panel: Axes, over: Array, values: Array, colour: str) -> None:
    """Median of each bin that holds enough samples."""
    edges = np.linspace(over.min(), over.max() + 1e-9, _BINS + 1)
    bins = np.digitize(over, edges)
    full = [b for b in range(1, _BINS + 1) if np.count_nonzero(bins == b) >= _LEAST_IN_BIN]
    centers = [0.5 * (edges[b - 1] + edges[b]) for b in full]
    panel.plot(centers, [np.median(values[bins == b]) for b in full], "-o", ms=2, color=colour)
