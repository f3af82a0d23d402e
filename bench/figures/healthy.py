"""Figs 3 and 6: power and speed of a healthy robot, modelled against measured.

The robot is 5 % off its description in every value; both power models are fitted to the same three
minutes of other drives.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from figures.calibrated import Calibrated, calibrated
from figures.page import MEASURED, MUTED, PHYSICAL, WANG2024, lines, page, titled
from figures.result import Result
from figures.simulated import (
    COLUMNS,
    Played,
    driven,
    exact,
    of_robot,
    played,
    scores,
    speed_scores,
)
from tomr_power_model.model.scores import accuracy
from tomr_power_model.robot import Robot
from tomr_sim_bridge.missions import Mission, load_mission, parse_mission

Array = NDArray[np.float64]

ALONG_Y = """
name: along_y
phases:
  - {pause: 2.0}
  - {twist: [0.0, 0.4, 0.0], duration: 4.0}
  - {pause: 3.0}
"""
# The command is a step, the drivers ramp it; a stage ends when the ramp and its settling have.
STAGES = {"standing": (0.2, 2.0), "start": (2.0, 2.6), "steady": (2.6, 6.0), "stop": (6.0, 6.6)}
_SEED = 5  # of sensor noise
_COLOURS = {"physical": PHYSICAL, "wang2024": WANG2024}

Drives = Mapping[str, Played]


def fig3(scratch: Path) -> Result:
    """Speed and power of one drive along +Y."""
    robots = calibrated(scratch)
    measured, true = _both(parse_mission(ALONG_Y, "along_y"), robots)
    first = measured["physical"]
    standby = float(np.median(first.measured[first.rows(*STAGES["standing"]), 4]))
    by_stage = {
        stage: {
            "measured": {model: _stage(found, *span) for model, found in measured.items()},
            "true power": {model: _stage(found, *span) for model, found in true.items()},
        }
        for stage, span in STAGES.items()
    }
    return Result(
        "Fig. 3: one drive along +Y, accuracy % / NRMSE",
        ("model", "against", *COLUMNS[3:], *STAGES),
        [
            (
                model,
                against,
                *(_cell(scores(f.measured, f.modelled)[name]) for name in COLUMNS[3:]),
                *(f"{100 * by_stage[stage][against][model]['accuracy']:.1f}" for stage in STAGES),
            )
            for against, drives in (("measured", measured), ("true power", true))
            for model, f in drives.items()
        ],
        {
            **_numbers(measured, true),
            "stages_of_the_whole_robot": by_stage,
            "standby_W": standby,
            "least_measured_W": float(first.measured[:, 4].min()),
        },
        _speed_and_power(measured, robots.robot, standby),
        (f"standing {standby:.2f} W, least while stopping {first.measured[:, 4].min():.2f} W",),
    )


def fig6(scratch: Path) -> Result:
    """The mission of four phases, healthy."""
    robots = calibrated(scratch)
    measured, true = _both(load_mission("paper_phases"), robots)
    return Result(
        "Fig. 6: the four phases, healthy, accuracy % / NRMSE",
        ("model", "against", *COLUMNS, "wheel speeds"),
        [
            (
                model,
                against,
                *(_cell(scores(found.measured, found.modelled)[name]) for name in COLUMNS),
                _cell(speed_scores(found)),
            )
            for against, drives in (("measured", measured), ("true power", true))
            for model, found in drives.items()
        ],
        _numbers(measured, true),
        _motors(measured),
    )


def _both(mission: Mission, robots: Calibrated) -> tuple[Drives, Drives]:
    """The mission as measured, and against the plant's true power, by power model."""
    found = []
    for plant in (robots.plant, exact(robots.plant)):
        heard = driven(mission, plant, _SEED)
        found.append(
            {n: played(heard, robots.robot, values) for n, values in robots.models.items()}
        )
    return found[0], found[1]


def _stage(found: Played, since: float, until: float) -> dict[str, float]:
    """Figures of the whole robot between two times [s]."""
    rows = found.rows(since, until)
    measured, modelled = found.measured[rows, 4], found.modelled[rows, 4]
    return {
        "accuracy": accuracy(measured, modelled),
        "mean_measured_W": float(measured.mean()),
        "mean_modelled_W": float(modelled.mean()),
    }


def _cell(score: Mapping[str, float]) -> str:
    return f"{100 * score['accuracy']:.2f} / {score['nrmse']:.3f}"


def _numbers(measured: Drives, true: Drives) -> dict[str, Any]:
    return {
        against: {
            model: {
                "power": scores(found.measured, found.modelled),
                "wheel_speed": speed_scores(found),
            }
            for model, found in drives.items()
        }
        for against, drives in (("against_measured", measured), ("against_true_power", true))
    }


def _speed_and_power(drives: Drives, robot: Robot, standby: float) -> Figure:
    figure = page(9.0, 7.0)
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(2, 3, 2))
    first = drives["physical"]
    measured, expected = of_robot(robot, first.speed), of_robot(robot, first.expected)
    speeds = (("measured", measured, MEASURED), ("modelled", expected, PHYSICAL))
    lines(upper, first.time, speeds, 1.4)
    upper.set_ylabel("speed, m/s")
    titled(upper, "Speed of the robot along +Y")
    lines(middle, first.time, _curves(drives, 4), 1.4)
    middle.axhline(standby, color=MUTED, lw=0.8, ls=":")
    middle.set_ylabel("power, W")
    titled(middle, "Power of the whole robot, means of 50 ms; dotted: standing")
    _errors(lower, drives)
    lower.set_xlabel("time, s")
    lower.set_xlim(0.0, float(first.time[-1]))
    for axis in (upper, middle):
        axis.legend(fontsize=8, frameon=False, loc="upper right")
    return figure


def _errors(axis: Axes, drives: Drives) -> None:
    """Measured minus modelled power of the whole robot."""
    errors = [(n, d.measured[:, 4] - d.modelled[:, 4], _COLOURS[n]) for n, d in drives.items()]
    time = next(iter(drives.values())).time
    lines(axis, time, errors[::-1], 1.1)
    axis.axhline(0.0, color=MUTED, lw=0.6)
    axis.set_ylabel("error, W")
    titled(axis, "Measured - modelled, whole robot")


def _curves(drives: Drives, column: int) -> list[tuple[str, Array, str]]:
    measured = next(iter(drives.values())).measured[:, column]
    models = [(f"modelled, {n}", d.modelled[:, column], _COLOURS[n]) for n, d in drives.items()]
    return [("measured", measured, MEASURED), *models[::-1]]


def _motors(drives: Drives) -> Figure:
    figure = page(12.0, 7.8)
    axes = figure.subplots(4, 2, sharex=True, width_ratios=(3, 2))
    first = drives["physical"]
    for row, column in enumerate((4, 0, 1, 2)):
        axis = axes[row, 0]
        lines(axis, first.time, _curves(drives, column))
        axis.set_ylabel("power, W")
        titled(axis, "Whole robot" if column == 4 else f"Motor {column + 1}")
    _errors(axes[0, 1], drives)
    for wheel in range(3):
        axis = axes[wheel + 1, 1]
        speed, expected = first.speed[:, wheel], first.expected[:, wheel]
        lines(axis, first.time, (("measured", speed, MEASURED), ("modelled", expected, PHYSICAL)))
        axis.set_ylabel("speed, rad/s")
        titled(axis, f"Wheel {wheel + 1}")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=9, frameon=False)
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
        axis.set_xlim(0.0, float(first.time[-1]))
        axis.set_xticks(range(0, 27, 2))
    return figure
