"""Pictures of a calibration, as PNG for embedding in a page."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.calibration.samples import TOTAL, Samples
from tomr_power_model.canvas import AFTER, BEFORE, MEASURED, broken, medians, png, scatter, sheet
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]


def over_time(samples: Samples, robot: Robot) -> str:
    """Measured and modelled power of each motor and of the robot over time."""
    modelled = modelled_power(robot, samples.motion, samples.parts)
    shown = [c for c in range(TOTAL + 1) if np.isfinite(samples.measured[:, c]).any()]
    names = (*robot.wheel_names, "whole robot")
    with sheet(len(shown), 1, 1.7) as (page, panels):
        for panel, channel in zip(panels, shown, strict=True):
            known = np.isfinite(samples.measured[:, channel])
            time = samples.time[known]
            for values, colour, width, label in (
                (samples.measured[known, channel], MEASURED, 0.8, "measured"),
                (modelled[known, channel], BEFORE, 1.0, "modelled"),
            ):
                panel.plot(*broken(time, values), color=colour, lw=width, label=label)
            panel.set_ylabel(f"{names[channel]}\nW", fontsize=8)
            panel.set_xlim(time[0], time[-1])
        panels[0].legend(loc="upper right", fontsize=8, ncols=2, framealpha=0.8)
        panels[-1].set_xlabel("s")
        for panel in panels[:-1]:
            panel.tick_params(labelbottom=False)
        return png(page)


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
    with sheet(WHEELS, 3, 2.3) as (page, panels):
        for wheel, name in enumerate(robot.wheel_names):
            row = panels[3 * wheel : 3 * wheel + 3]
            _scatter(row[0], speed[:, wheel], rest[:, wheel], span, "wheel speed, rad/s")
            _scatter(row[1], acceleration[:, wheel], rest[:, wheel], span, "acceleration, rad/s²")
            _scatter(row[2], heading, rest[:, wheel], span, "heading of motion, degrees")
            row[0].set_ylabel(f"{name}\nmeasured - modelled, W", fontsize=8)
            if wheel < WHEELS - 1:
                for panel in row:
                    panel.set_xlabel("")
        return png(page)


def _common_range(rest: Array) -> float:
    known = np.abs(rest[np.isfinite(rest)])
    return float(np.percentile(known, 99.5)) if len(known) else 1.0


def _scatter(panel: Axes, over: Array, rest: Array, span: float, label: str) -> None:
    """Dots, and the median of each bin that holds enough of them."""
    known = np.isfinite(over) & np.isfinite(rest)
    over, rest = over[known], rest[known]
    scatter(panel, over, rest)
    if len(over):
        medians(panel, over, rest, AFTER)
    panel.axhline(0.0, color="black", lw=0.6)
    panel.set_ylim(-span, span)
    panel.set_xlabel(label, fontsize=8)
