"""Pictures of a calibration, as PNG for embedding in a page."""

import base64
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.calibration.samples import TOTAL, Samples
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_MEASURED, _MODELLED, _ERROR = "#8a8f98", "#c2410c", "#1d4ed8"
_BINS = 24
_LEAST_IN_BIN = 8
_MOST_DOTS = 6000
_BREAK = 0.25  # s without a sample: the line is broken


def over_time(samples: Samples, robot: Robot) -> str:
    """Measured and modelled power of each motor and of the robot over time."""
    modelled = modelled_power(robot, samples.motion, samples.parts)
    shown = [c for c in range(TOTAL + 1) if np.isfinite(samples.measured[:, c]).any()]
    names = (*robot.wheel_names, "whole robot")
    with _figure(len(shown), 1, 1.7) as (page, panels):
        for panel, channel in zip(panels, shown, strict=True):
            known = np.isfinite(samples.measured[:, channel])
            time = samples.time[known]
            gaps = np.flatnonzero(np.diff(time) > _BREAK) + 1
            for values, colour, width, label in (
                (samples.measured[known, channel], _MEASURED, 0.8, "measured"),
                (modelled[known, channel], _MODELLED, 1.0, "modelled"),
            ):
                line = np.insert(values, gaps, np.nan)
                panel.plot(np.insert(time, gaps, np.nan), line, color=colour, lw=width, label=label)
            panel.set_ylabel(f"{names[channel]}\nW", fontsize=8)
            panel.set_xlim(time[0], time[-1])
        panels[0].legend(loc="upper right", fontsize=8, ncols=2, framealpha=0.8)
        panels[-1].set_xlabel("s")
        for panel in panels[:-1]:
            panel.tick_params(labelbottom=False)
        return _png(page)


def residuals(samples: tuple[Samples, ...], robot: Robot) -> str:
    """What the model leaves, against speed, acceleration and heading, wheel by wheel."""
    motion = [item.mean_motion for item in samples]
    speed = np.concatenate([item.speed for item in motion])
    acceleration = np.concatenate([item.acceleration for item in motion])
    measured = np.concatenate([item.measured for item in samples])
    modelled = [modelled_power(robot, item.motion, item.parts) for item in samples]
    rest = (measured - np.concatenate(modelled))[:, :WHEELS]
    twist = speed @ wheels_to_twist(robot).T
    heading = np.degrees(np.arctan2(twist[:, 1], twist[:, 0]))
    heading = np.where(np.hypot(twist[:, 0], twist[:, 1]) > 0.05, heading, np.nan)
    span = _common_range(rest)
    with _figure(WHEELS, 3, 2.3) as (page, panels):
        for wheel, name in enumerate(robot.wheel_names):
            row = panels[3 * wheel : 3 * wheel + 3]
            _scatter(row[0], speed[:, wheel], rest[:, wheel], span, "wheel speed, rad/s")
            _scatter(row[1], acceleration[:, wheel], rest[:, wheel], span, "acceleration, rad/s²")
            _scatter(row[2], heading, rest[:, wheel], span, "heading of motion, degrees")
            row[0].set_ylabel(f"{name}\nmeasured - modelled, W", fontsize=8)
            if wheel < WHEELS - 1:
                for panel in row:
                    panel.set_xlabel("")
        return _png(page)


def _common_range(rest: Array) -> float:
    known = np.abs(rest[np.isfinite(rest)])
    return float(np.percentile(known, 99.5)) if len(known) else 1.0


def _scatter(panel: Axes, over: Array, rest: Array, span: float, label: str) -> None:
    """Dots, and the median of each bin that holds enough of them."""
    known = np.isfinite(over) & np.isfinite(rest)
    over, rest = over[known], rest[known]
    step = max(1, len(over) // _MOST_DOTS)
    panel.plot(over[::step], rest[::step], ".", ms=1.2, color=_MEASURED, alpha=0.35)
    if len(over):
        edges = np.linspace(over.min(), over.max() + 1e-9, _BINS + 1)
        bins = np.digitize(over, edges)
        full = [b for b in range(1, _BINS + 1) if np.count_nonzero(bins == b) >= _LEAST_IN_BIN]
        centers = [0.5 * (edges[b - 1] + edges[b]) for b in full]
        panel.plot(centers, [np.median(rest[bins == b]) for b in full], "-o", ms=2, color=_ERROR)
    panel.axhline(0.0, color="black", lw=0.6)
    panel.set_ylim(-span, span)
    panel.set_xlabel(label, fontsize=8)


@contextmanager
def _figure(rows: int, columns: int, height: float) -> Iterator[tuple[Figure, list[Axes]]]:
    page = Figure(figsize=(10.0, height * rows + 0.4), dpi=110, layout="constrained")
    panels = list(page.subplots(rows, columns, squeeze=False).ravel())
    for panel in panels:
        panel.grid(alpha=0.25, lw=0.5)
        panel.tick_params(labelsize=7)
        panel.spines[["top", "right"]].set_visible(False)
    yield page, panels


def _png(page: Figure) -> str:
    """The figure as a data URL."""
    buffer = BytesIO()
    page.savefig(buffer, format="png")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
