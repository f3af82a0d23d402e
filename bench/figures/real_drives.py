"""Figs 3 and 6 on a real robot: power and speed of Robotino drives that no model was fitted to.

Power is that of the motors: their current is measured, their voltage modelled.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from figures import real
from figures.page import MEASURED, MUTED, PHYSICAL, WANG2024, lines, page, plain, titled
from figures.result import Result
from figures.simulated import Played, of_robot
from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.drive.motion import median_period
from tomr_power_model.model.scores import accuracy, nrmse

Array = NDArray[np.float64]

SPEEDS = (0.1, 0.2, 0.3)  # m/s
SHOWN = 40.0  # degrees: the drive of each speed that is drawn
_COLOURS = {"physical": PHYSICAL, "wang2024": WANG2024}
_WORST = 5  # drives that are named
_SMOOTH = 0.5  # s, for the eye only
_MARKERS = dict(zip(SPEEDS, ("o", "s", "^"), strict=True))


@frozen
class Scored:
    """A drive, and what each model says of its motors' sum [W], (n,)."""

    item: real.RealDrive
    modelled: Mapping[str, Array]

    def energy(self, model: str) -> float:
        """Accuracy of the energy of the whole drive."""
        measured = self.item.measured.sum(keepdims=True)
        return accuracy(measured, self.modelled[model].sum(keepdims=True))


def fig6_robotino(scratch: Path) -> Result:
    """Power and speed of the real Robotino, drives not fitted."""
    drives = real.drives("gray", scratch)
    paper = real.paper_model([item for item in drives if item.drive.fitted_heading])
    robot = real.robot()
    scored = []
    for item in drives:
        if not item.drive.fitted_heading:
            physical = modelled_power(robot, item.samples.motion, item.samples.parts)
            power = paper.power(item.samples.mean_motion).power
            models = {"physical": physical[:, :3].sum(axis=1), "wang2024": power.sum(axis=1)}
            scored.append(Scored(item, models))
    shown = [_shown(scored, speed) for speed in SPEEDS]
    streamed = [real.as_streamed(drive.item) for drive in shown]
    numbers = {
        model: {
            "all": _figures(model, scored),
            **{
                f"{speed} m/s": _figures(model, [d for d in scored if d.item.drive.speed == speed])
                for speed in SPEEDS
            },
        }
        for model in _COLOURS
    }
    return Result(
        "Figs 3, 6: Robotino, gray floor, headings not fitted: power of the motors",
        ("model, drives", "count", "energy, median", "energy, worst", "samples", "NRMSE", "1 s"),
        [
            (f"{model}, {which}", *_cells(found))
            for model, by_speed in numbers.items()
            for which, found in by_speed.items()
        ],
        {"models": numbers, "shown": [drive.item.drive.path.name for drive in shown]},
        _picture(scored, shown, streamed),
        (
            "accuracy: of a drive's energy; of samples at 32 Hz, of means of 1 s. physical: fitted "
            "to the other headings at 0.1 m/s;\nwang2024: to the other headings at all three "
            "speeds.",
            *(f"worst of {model}: {', '.join(n['all']['worst'])}" for model, n in numbers.items()),
        ),
    )


def _shown(scored: Sequence[Scored], speed: float) -> Scored:
    return next(
        drive
        for drive in scored
        if drive.item.drive.speed == speed and drive.item.drive.heading == SHOWN
    )


def _figures(model: str, scored: Sequence[Scored]) -> dict[str, Any]:
    energy = np.array([drive.energy(model) for drive in scored])
    measured = np.concatenate([drive.item.measured for drive in scored])
    modelled = np.concatenate([drive.modelled[model] for drive in scored])
    seconds = [_by_second(drive, model) for drive in scored]
    return {
        "drives": len(scored),
        "energy_median": float(np.median(energy)),
        "energy_worst": float(energy.min()),
        "worst": [_place(scored[index].item) for index in np.argsort(energy)[:_WORST]],
        "samples_accuracy": accuracy(measured, modelled),
        "samples_nrmse": nrmse(measured, modelled),
        "seconds_accuracy": accuracy(
            *(np.concatenate(part) for part in zip(*seconds, strict=True))
        ),
    }


def _place(item: real.RealDrive) -> str:
    return f"{item.drive.heading:.0f}° at {item.drive.speed:.1f} m/s"


def _by_second(drive: Scored, model: str) -> tuple[Array, Array]:
    """Measured and modelled energy in each second [arbitrary units, the same for both]."""
    second = np.unique(np.floor(drive.item.samples.time), return_inverse=True)[1]
    measured = np.bincount(second, drive.item.measured)
    return measured.astype(np.float64), np.bincount(second, drive.modelled[model]).astype(
        np.float64
    )


def _cells(found: Mapping[str, Any]) -> tuple[str, ...]:
    names = ("energy_median", "energy_worst", "samples_accuracy")
    cells = (f"{100 * found[name]:.1f} %" for name in names)
    nrmse_, seconds = found["samples_nrmse"], found["seconds_accuracy"]
    return (str(found["drives"]), *cells, f"{nrmse_:.2f}", f"{100 * seconds:.1f} %")


def _picture(
    scored: Sequence[Scored], shown: Sequence[Scored], streamed: Sequence[Played]
) -> Figure:
    figure = page(12.0, 8.6)
    grid = figure.add_gridspec(3, 6, height_ratios=(1, 1.35, 1.7))
    robot = real.robot()
    for column, (drive, found) in enumerate(zip(shown, streamed, strict=True)):
        upper = figure.add_subplot(grid[0, 2 * column : 2 * column + 2])
        measured, expected = of_robot(robot, found.speed), of_robot(robot, found.expected)
        curves = (("measured", measured, MEASURED), ("modelled", expected, PHYSICAL))
        lines(upper, found.time, curves)
        titled(upper, f"{drive.item.drive.speed} m/s, heading {SHOWN:.0f}°: speed of the robot")
        lower = figure.add_subplot(grid[1, 2 * column : 2 * column + 2])
        _power(lower, drive)
        titled(lower, "Power of the motors")
        for axis in (upper, lower):
            axis.set_xlim(0.0, float(found.time[-1]))
            axis.set_ylim(bottom=0.0)
            axis.set_xlabel("time, s", fontsize=8)
        if not column:
            upper.set_ylabel("m/s")
            lower.set_ylabel("W")
            handles, labels = lower.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper right",
        ncols=4,
        fontsize=9,
        frameon=False,
        markerscale=4,
    )
    for column, model in enumerate(_COLOURS):
        _scatter(figure.add_subplot(grid[2, 3 * column : 3 * column + 3]), scored, model)
    return figure


def _power(axis: Axes, drive: Scored) -> None:
    time, measured = drive.item.samples.time, drive.item.measured
    axis.plot(time, measured, ".", color=MEASURED, ms=1.5, alpha=0.5, label="measured, samples")
    width = max(1, round(_SMOOTH / median_period(time)))
    inside = slice(width // 2, -(width // 2) or None)

    def smooth(values: Array) -> Array:
        return np.convolve(values, np.ones(width) / width, mode="same")[inside]

    axis.plot(time[inside], smooth(measured), color=MUTED, lw=1.8, label="measured, mean of 0.5 s")
    for model, values in reversed(list(drive.modelled.items())):
        label = f"modelled, {model}, mean of 0.5 s"
        axis.plot(time[inside], smooth(values), color=_COLOURS[model], lw=1.2, label=label)
    axis.set_ylim(0.0, 1.15 * float(np.percentile(measured, 99)))
    plain(axis)


def _scatter(axis: Axes, scored: Sequence[Scored], model: str) -> None:
    """Mean power of each drive, modelled against measured."""
    ends = (10.0, 34.0)  # W
    for speed in SPEEDS:
        pairs = np.array(
            [
                (drive.item.measured.mean(), drive.modelled[model].mean())
                for drive in scored
                if drive.item.drive.speed == speed
            ]
        )
        axis.plot(
            *pairs.T,
            _MARKERS[speed],
            ms=4,
            color=_COLOURS[model],
            alpha=0.75,
            label=f"{speed} m/s",
            fillstyle="full" if speed == SPEEDS[0] else "none",
        )
    axis.plot(ends, ends, color=MUTED, lw=0.8, ls=":")
    plain(axis)
    axis.legend(fontsize=8, frameon=False, loc="upper left")
    axis.set_xlabel("measured mean power of a drive, W", fontsize=9)
    axis.set_ylabel("modelled, W", fontsize=9)
    median = 100 * np.median([drive.energy(model) for drive in scored])
    titled(axis, f"{model}: 108 drives not fitted, median accuracy of the energy {median:.1f} %")
