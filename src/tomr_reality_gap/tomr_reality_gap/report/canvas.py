"""Sheets of panels that look alike, as PNG for embedding in a page."""

import base64
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEASURED, BEFORE, AFTER, PLACE = "#8a8f98", "#c2410c", "#1d4ed8", "#fde68a"
_BREAK = 3.0  # usual periods without a sample: the line is broken


@contextmanager
def sheet(
    rows: int, columns: int, height: float, heights: Sequence[float] | None = None
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure of so many panels, each `height` inches high on the average."""
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
    gaps = np.flatnonzero(np.diff(time) > _BREAK * float(np.median(np.diff(time)))) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)


def smooth(values: Array, over: int) -> Array:
    """Running mean over so many samples, fewer at the ends."""
    if over < 2 or not len(values):
        return values
    kernel = np.ones(min(over, len(values)))
    return np.asarray(
        np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same")
    )
