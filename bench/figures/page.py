"""How the pictures look."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

Array = NDArray[np.float64]

DPI = 100
INK, MUTED = "#22262b", "#6b727b"
MEASURED, PHYSICAL, WANG2024, DERIVED = "#9aa1ab", "#c2410c", "#1d4ed8", "#15803d"
CODE_COLOURS = ("#1d4ed8", "#f1f2f4", "#c2410c")  # of -1, 0, 1
_COLOURS = 256  # in a file: lines and flat areas need no more, and it stays small


def page(width: float, height: float) -> Figure:
    """An empty figure of so many inches."""
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plain(axis: Axes) -> None:
    """A panel without a frame, with a faint grid."""
    axis.grid(alpha=0.25, lw=0.5)
    axis.tick_params(labelsize=8, colors=INK)
    axis.spines[["top", "right"]].set_visible(False)


def lines(
    axis: Axes, time: Array, curves: Sequence[tuple[str, Array, str]], width: float = 1.1
) -> None:
    """Curves (label, values, colour) over time [s]; what is measured is drawn below the models."""
    for label, values, colour in curves:
        measured = colour == MEASURED
        axis.plot(
            time,
            values,
            color=colour,
            lw=2.4 * width if measured else width,
            zorder=1 if measured else 2,
            label=label,
        )
    plain(axis)


def titled(axis: Axes, text: str) -> None:
    """A title at the left of a panel."""
    axis.set_title(text, loc="left", fontsize=9, color=INK)


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png")
    with Image.open(buffer) as image:
        few = image.convert("RGB").quantize(
            _COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
        )
        few.save(path, optimize=True)
