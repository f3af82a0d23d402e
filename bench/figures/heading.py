"""Fig. 5: power against the direction of motion, every 5 degrees."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from figures import paper_model, real
from figures.harmonics import HIGHEST, Harmonics, harmonics
from figures.page import MEASURED, MUTED, PHYSICAL, WANG2024, page, plain, titled
from figures.result import Result
from figures.simulated import PHYSICAL as PHYSICAL_MODEL
from figures.simulated import ROBOT, driven, plain_mission, played, reference
from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.wang2024 import Coefficients
from tomr_sim_bridge.missions import Mission
from tomr_sim_bridge.missions.schema import TwistPhase

Array = NDArray[np.float64]
Curves = Mapping[str, Array]  # power [W] at each heading, (72,)

STEP = 5  # degrees
HEADINGS = np.arange(0, 360, STEP)
_SPEED, _HOLD, _SETTLE = 0.4, 3.0, 0.6  # m/s, s, s of the hold that are not counted
_PAUSE = 1.0
_SEED = 5
_COLOURS = {"measured": MEASURED, "physical": PHYSICAL, "wang2024": WANG2024}


def fig5(scratch: Path) -> Result:
    """Power against heading, simulated robot."""
    robot = reference()
    heard = driven(_every_heading(), robot, _SEED)
    models = {
        "physical": PHYSICAL_MODEL,
        "wang2024": paper_model.parameters(Coefficients.load(ROBOT)),
    }
    curves: dict[str, Array] = {}
    for model, parameters in models.items():
        found = played(heard, robot, parameters)
        begins = _PAUSE + _HOLD * np.arange(len(HEADINGS))
        rows = [found.rows(begin + _SETTLE, begin + _HOLD) for begin in begins]
        curves["measured"] = np.array([found.measured[row, 3].mean() for row in rows])
        curves[model] = np.array([found.modelled[row, 3].mean() for row in rows])
    standing = float(found.measured[found.rows(0.2, _PAUSE), 3].mean())
    title = "Fig. 5: power of the motors against heading, MuJoCo, 0.4 m/s"
    return _result(title, {"": curves}, standing)


def fig5_robotino(scratch: Path) -> Result:
    """Power against heading, real Robotino, two floors."""
    gray = real.drives("gray", scratch)
    paper = real.paper_model([item for item in gray if item.drive.fitted_heading])
    floors = {"gray": gray, "green": real.drives("green", scratch, [0.1])}
    found = {}
    for floor, drives in floors.items():
        slow = sorted((d for d in drives if d.drive.speed == 0.1), key=lambda d: d.drive.heading)
        robot = real.robot()
        curves: dict[str, list[float]] = {"measured": [], "physical": [], "wang2024": []}
        for item in slow:
            steady, motion = item.steady, item.samples.mean_motion
            physical = modelled_power(robot, item.samples.motion, item.samples.parts)[:, :3]
            curves["measured"].append(float(item.measured[steady].mean()))
            curves["physical"].append(float(physical[steady].sum(axis=1).mean()))
            curves["wang2024"].append(float(paper.power(motion).power[steady].sum(axis=1).mean()))
        found[floor] = {name: np.array(values) for name, values in curves.items()}
    return _result("Fig. 5: power of the motors against heading, Robotino, 0.1 m/s", found, 0.0)


def _every_heading() -> Mission:
    """One drive that turns its direction by 5 degrees every 3 s."""
    phases = [TwistPhase((0.0, 0.0, 0.0), _PAUSE)]
    for heading in np.radians(HEADINGS):
        twist = (_SPEED * math.cos(heading), _SPEED * math.sin(heading), 0.0)
        phases.append(TwistPhase(twist, _HOLD))
    return plain_mission("every_heading", phases)


def _result(title: str, floors: Mapping[str, Curves], standing: float) -> Result:
    found = {
        floor: {name: harmonics(curve, standing) for name, curve in curves.items()}
        for floor, curves in floors.items()
    }
    rows, numbers = [], {}
    for floor, by_name in found.items():
        curves = floors[floor]
        numbers[floor or "MuJoCo"] = {
            name: {
                **item.numbers,
                "accuracy": accuracy(curves["measured"], curves[name]),
                "nrmse": nrmse(curves["measured"], curves[name]),
                "power_by_heading_W": curves[name].tolist(),
            }
            for name, item in by_name.items()
        }
        for name, item in by_name.items():
            score = (
                "" if name == "measured" else f"{accuracy(curves['measured'], curves[name]):.2%}"
            )
            rows.append((f"{floor} {name}".strip(), *_cells(item), score))
    return Result(
        title,
        ("", "mean, W", "6th harmonic", "most at", "remainder, RMS", "accuracy"),
        rows,
        {"headings_deg": HEADINGS.tolist(), "standing_W": standing, "curves": numbers},
        _picture(floors, found),
        (
            f"mean: above the {standing:.2f} W of standing motors; 6th harmonic: amplitude with "
            "95 % interval, % of the mean;\nmost at: heading modulo 60 degrees; remainder: what "
            "does not repeat every 60 degrees, % of the mean",
        ),
    )


def _cells(item: Harmonics) -> Sequence[str]:
    return (
        f"{item.mean:.3f}",
        f"{100 * item.sixth:.2f} ± {100 * item.interval:.2f} %",
        f"{item.most:.1f}°",
        f"{100 * item.remainder:.2f} %",
    )


def _picture(floors: Mapping[str, Curves], found: Mapping[str, Mapping[str, Harmonics]]) -> Figure:
    figure = page(11.0, 3.7 * len(floors) + 0.2)
    axes = figure.subplots(len(floors), 2, width_ratios=(3, 2), squeeze=False)
    for (left, right), (floor, curves) in zip(axes, floors.items(), strict=True):
        _over_heading(left, curves)
        _spectrum(right, found[floor])
        place = f", {floor} floor" if floor else ""
        titled(left, f"Power of the three motors{place}")
        titled(right, "Harmonics; dark grey: those with 60-degree symmetry")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=9, frameon=False)
    axes[-1, 0].set_xlabel("heading of motion from +x of the robot, degrees")
    axes[-1, 1].set_xlabel("harmonic, periods per turn")
    return figure


def _over_heading(axis: Axes, curves: Curves) -> None:
    closed = np.append(HEADINGS, 360)
    for name, curve in curves.items():
        values = np.append(curve, curve[0])
        if name == "measured":
            axis.plot(closed, values, "o-", color=MEASURED, ms=4, lw=1.0, label=name)
        else:
            axis.plot(closed, values, color=_COLOURS[name], lw=1.3, label=f"modelled, {name}")
    plain(axis)
    axis.set_xticks(range(0, 361, 60))
    axis.set_xlim(0, 360)
    axis.set_ylabel("power, W")


def _spectrum(axis: Axes, found: Mapping[str, Harmonics]) -> None:
    width = 0.8 / len(found)
    numbers = np.arange(1, HIGHEST + 1)
    for place, (name, item) in enumerate(found.items()):
        colours = [
            MUTED if name == "measured" and number % 6 == 0 else _COLOURS[name]
            for number in numbers
        ]
        shift = (place - 0.5 * (len(found) - 1)) * width
        axis.bar(numbers + shift, 100 * np.array(item.amplitudes), width, color=colours)
    measured = found["measured"]
    axis.errorbar(
        6 - 0.5 * (len(found) - 1) * width,
        100 * measured.sixth,
        100 * measured.interval,
        color="black",
        capsize=2,
        lw=1.0,
    )
    plain(axis)
    axis.set_xticks(numbers)
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("amplitude, % of the mean")
