"""Pictures of what has no name: its table with the law that stands for it."""

from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tomr_power_model.canvas import AFTER, BEFORE, png, sheet
from tomr_power_model.unmodelled import LearntTerm
from tomr_power_model.unmodelled.term import value_at
from tomr_reality_gap.explanation import FittedLaw, Learnt, Shape
from tomr_reality_gap.fit.law_forms import LAWS

Array = NDArray[np.float64]

_FINE = 81  # points along each variable
_ARROWS = 15
_EXTREME = 0.01  # of a map, at either end of its colours
_KNOWN = 0.5  # of the least known standard deviation: a map is shown where it is better known


def unnamed_picture(shape: Shape, learnt: Learnt | None) -> str:
    """Of one variable with its interval and law; of two as a map beside its law's."""
    if learnt is not None and len(learnt.term.knots) == 2:
        return _maps(learnt)
    with sheet(1, 1, 2.6) as (page, panels):
        panel = panels[0]
        panel.fill_between(shape.at, shape.low, shape.high, color=AFTER, alpha=0.2, lw=0)
        panel.plot(shape.at, shape.value, color=AFTER, lw=1.3, label="as learnt")
        if learnt is not None and learnt.laws:
            at = np.linspace(shape.at[0], shape.at[-1], 4 * _FINE)
            law = law_values(learnt.laws[0], at[:, None])[0]
            panel.plot(at, law, "--", color=BEFORE, lw=1.0, label=learnt.laws[0].name)
            panel.legend(fontsize=8, frameon=False)
        panel.axhline(0.0, color="black", lw=0.6)
        panel.set_xlabel(shape.variable, fontsize=8)
        panel.set_ylabel(f"{shape.wheel}\n{shape.unit}", fontsize=8)
        return png(page)


def law_values(fitted: FittedLaw, at: Array) -> Array:
    """A law with its parameters at some places (k, axes): (1, k), or x and y of a force, (2, k)."""
    law = LAWS[fitted.name]
    parameters = np.array([fitted.parameters[name].value for name in law.units])
    return np.atleast_2d(law.value(parameters, at))


def _maps(learnt: Learnt) -> str:
    term = learnt.term
    lines = [np.linspace(points[0], points[-1], _FINE) for points in term.knots]
    at = np.array(list(product(*lines)))
    shown = [("as learnt", _learnt_at(term, learnt.sigma, at))]
    shown += [(law.name, law_values(law, at)) for law in learnt.laws[:1]]
    sizes = np.concatenate([_size(values) for _, values in shown])
    low, most = np.nanquantile(sizes, [_EXTREME, 1.0 - _EXTREME]).tolist()
    with sheet(1, len(shown), 3.6) as (page, panels):
        for panel, (title, values) in zip(panels, shown, strict=True):
            _map(page, panel, lines, values, (min(low, 0.0), most), term.unit)
            panel.set_title(title, fontsize=8)
            panel.set_xlabel(term.family.axes[0].title, fontsize=8)
            panel.set_ylabel(term.family.axes[1].title, fontsize=8)
        return png(page)


def _learnt_at(term: LearntTerm, sigma: Array, at: Array) -> Array:
    """NaN where no more is known than before."""
    rows = np.stack([value_at(term.family, term.knots, row, at) for row in term.values])
    unsure = np.stack([value_at(term.family, term.knots, row, at) for row in sigma])
    known = unsure.max(axis=0) < _KNOWN * float(sigma.max())
    return np.where(known, rows, np.nan)


def _size(values: Array) -> Array:
    """Signed where there is one component, else the length."""
    return np.asarray(values[0] if len(values) == 1 else np.hypot(*values))


def _map(
    page: Figure,
    panel: Axes,
    lines: list[Array],
    values: Array,
    ends: tuple[float, float],
    unit: str,
) -> None:
    """Colours for the size, arrows for a force's direction."""
    grid = _size(values).reshape(_FINE, _FINE).T
    low, most = ends
    colours = panel.pcolormesh(*lines, grid, vmin=low, vmax=most, cmap="viridis", shading="nearest")
    bar = page.colorbar(colours, ax=panel, label=unit)
    bar.ax.tick_params(labelsize=7)
    if len(values) == 2:
        every = slice(_FINE // (2 * _ARROWS), None, _FINE // _ARROWS)
        x, y = (row.reshape(_FINE, _FINE).T[every, every] for row in values)
        panel.quiver(lines[0][every], lines[1][every], x, y, color="white", scale=20.0 * most)
    panel.set_aspect("equal")
    panel.grid(False)
