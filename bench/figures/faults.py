"""Figs 7 to 10: the paper's three faults in the four phases of its mission.

The fault holds from one second on, all the time of the drive. The robot is the reference robot. The
residual codes are those of the paper's 5 % band; the state is named by the diagnosis as it is
shipped, and by the paper's network with the codes and weights that are shipped for it.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from figures.page import CODE_COLOURS, DERIVED, INK, MEASURED, PHYSICAL, lines, page, titled
from figures.result import Result
from figures.simulated import (
    SENSOR_BANDS,
    Heard,
    Played,
    driven,
    of_robot,
    played,
    reference,
    true_speed,
)
from tomr_fault_diag.classifier.states import NORMAL, STATES
from tomr_sim_bridge.missions import load_mission

Array = NDArray[np.float64]

# Of the mission paper_phases [s]: the four motions, with standing between.
PHASES = {
    "1: 20 deg from -Y": (2.0, 6.0),
    "2: along wheel 2": (8.0, 12.0),
    "3: along wheel 1": (14.0, 18.0),
    "4: wheel 1 idle": (20.0, 24.0),
}
END = 26.0
_STATES = [state.name for state in STATES]
_FAULTS = _STATES[:NORMAL] + _STATES[NORMAL + 1 :]
_STATE_COLOURS = dict(
    zip(_STATES, ("#b9dcb8", "#8cb8e8", "#cba6e3", "#f09a8f", "#f2b48a", "#e88fb2"), strict=True)
)
_OTHER_COLOUR = "#d5d8dc"  # unknown, not observable
_CODES = (
    "I1 robot",
    *(f"I{n + 1} power {n}" for n in (1, 2, 3)),
    *(f"I{n + 4} speed {n}" for n in (1, 2, 3)),
    *(f"I{n + 7} power {n} vs encoder" for n in (1, 2, 3)),
)
_SEED = 5
# Who names the state: ours, and the paper's network on three-level codes.
_JUDGES = {"window": "ours", "wang2024": "paper's network"}


def fig7(scratch: Path) -> Result:
    """Control signal of motor 1 lost."""
    return _experiment("Fig. 7: control signal of motor 1 lost", "control_signal_lost")


def fig8(scratch: Path) -> Result:
    """Encoder of motor 1 lost."""
    return _experiment("Fig. 8: encoder of motor 1 lost", "encoder_lost")


def fig9(scratch: Path) -> Result:
    """Encoder of motor 1 lost: power solved from encoder data beside modelled and measured."""
    found = played(_drive("encoder_lost"), reference(), SENSOR_BANDS)
    rows, numbers = [], {}
    for phase, span in PHASES.items():
        inside = found.rows(*span)
        means = {
            "measured": found.measured[inside, 0],
            "modelled": found.modelled[inside, 0],
            "from_encoder": found.derived[inside, 0],
        }
        numbers[phase] = {name: float(values.mean()) for name, values in means.items()}
        numbers[phase]["share_above_both"] = float(
            np.mean((found.codes[inside, 1] == 1) & (found.codes[inside, 7] == 1))
        )
        share = f"{100 * numbers[phase]['share_above_both']:.0f} %"
        rows.append((phase, *(f"{values.mean():.2f}" for values in means.values()), share))
    headings = ("phase", "measured, W", "modelled, W", "from encoder, W", "above both")
    return Result(
        "Fig. 9: motor 1 with its encoder lost, mean power",
        headings,
        rows,
        {"motor_1_mean_power_W": numbers},
        _three_powers(found),
    )


def fig10(scratch: Path) -> Result:
    """Lubricated floor: all wheels slip."""
    return _experiment("Fig. 10: lubricated floor", "floor_slippery")


def _drive(fault: str) -> list[Heard]:
    return driven(load_mission(f"paper_phases_{fault}"), reference(), _SEED)


def _experiment(title: str, fault: str) -> Result:
    heard = _drive(fault)
    judged = {name: played(heard, reference(), {"classifier": name}) for name in _JUDGES}
    found = played(heard, reference(), SENSOR_BANDS)
    numbers: dict[str, Any] = {}
    rows = []
    for phase, span in PHASES.items():
        inside = found.rows(*span)
        numbers[phase] = {
            "mean_measured_W": found.measured[inside].mean(axis=0).tolist(),
            "mean_modelled_W": found.modelled[inside].mean(axis=0).tolist(),
            "mean_speed_rad_s": found.speed[inside].mean(axis=0).tolist(),
            "mean_expected_speed_rad_s": found.expected[inside].mean(axis=0).tolist(),
            "mean_codes": found.codes[inside].mean(axis=0).tolist(),
            "named": {name: _shares(item, span) for name, item in judged.items()},
        }
        pairs = zip(found.measured[inside].T, found.modelled[inside].T, strict=True)
        powers = [f"{ours.mean():.2f} / {model.mean():.2f}" for ours, model in pairs]
        rows.append((phase, *powers[:3], powers[4], *(_mostly(i, span) for i in judged.values())))
    first = {name: _first_named(item) for name, item in judged.items()}
    named = "; ".join(f"{_JUDGES[name]}: {what}" for name, what in first.items())
    return Result(
        f"{title}, mean power measured / modelled, W",
        ("phase", "motor 1", "motor 2", "motor 3", "robot", *_JUDGES.values()),
        rows,
        {"phases": numbers, "first_named": first},
        _picture(found, judged, true_speed(heard), title),
        (f"moves from {PHASES['1: 20 deg from -Y'][0]:.2f} s on; first named: {named}",),
    )


def _shares(found: Played, span: tuple[float, float]) -> dict[str, float]:
    """Share of the ticks of a span by named state."""
    named = np.array(found.states)[found.rows(*span)]
    return {state: count / len(named) for state, count in Counter(named.tolist()).most_common()}


def _mostly(found: Played, span: tuple[float, float]) -> str:
    state, share = next(iter(_shares(found, span).items()))
    return f"{state} {100 * share:.0f} %"


def _first_named(found: Played) -> str:
    for time, state in zip(found.time, found.states, strict=True):
        if state in _FAULTS:
            return f"{state} at {time:.2f} s"
    return "no fault"


def _picture(
    found: Played, judged: Mapping[str, Played], true: tuple[Array, Array], title: str
) -> Figure:
    figure = page(12.0, 9.2)
    grid = figure.add_gridspec(6, 2, height_ratios=(1, 1, 1, 1, 1.75, 0.45), width_ratios=(1, 1))
    axes = [figure.add_subplot(grid[row, side]) for row in range(4) for side in range(2)]
    for row, column in enumerate((4, 0, 1, 2)):
        axis = axes[2 * row]
        measured, modelled = found.measured[:, column], found.modelled[:, column]
        curves = (("measured", measured, MEASURED), ("modelled", modelled, PHYSICAL))
        lines(axis, found.time, curves)
        axis.set_ylabel("power, W")
        titled(axis, "Whole robot" if column == 4 else f"Motor {column + 1}")
    _robot_speed(axes[1], found, true)
    for wheel in range(3):
        axis = axes[2 * wheel + 3]
        speed, expected = found.speed[:, wheel], found.expected[:, wheel]
        lines(axis, found.time, (("measured", speed, MEASURED), ("modelled", expected, PHYSICAL)))
        axis.set_ylabel("speed, rad/s")
        titled(axis, f"Wheel {wheel + 1}")
    for axis in axes:
        _mark_phases(axis)
        axis.tick_params(labelbottom=axis in axes[-2:])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=2, fontsize=9, frameon=False)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, color=INK)
    codes, strip = figure.add_subplot(grid[4, :]), figure.add_subplot(grid[5, :])
    _codes(codes, found)
    _named(strip, judged)
    return figure


def _robot_speed(axis: Axes, found: Played, true: tuple[Array, Array]) -> None:
    """How fast the robot is meant to be, is by its wheels, and truly is."""
    robot = reference()
    expected, by_wheels = of_robot(robot, found.expected), of_robot(robot, found.speed)
    curves = (("by its wheels", by_wheels, MEASURED), ("modelled", expected, PHYSICAL))
    lines(axis, found.time, curves)
    axis.plot(*true, color=DERIVED, lw=1.1, label="true")
    axis.set_ylabel("speed, m/s")
    titled(axis, "Robot: by its wheels, modelled, and true (green)")


def _mark_phases(axis: Axes) -> None:
    for since, until in PHASES.values():
        axis.axvspan(since, until, color=CODE_COLOURS[1], lw=0, zorder=0)
    axis.set_xlim(0.0, END)
    axis.set_xticks(range(0, int(END) + 1, 2))


def _codes(axis: Axes, found: Played) -> None:
    """Three levels of the ten residuals over time."""
    colours = ListedColormap(CODE_COLOURS)
    edges = np.append(found.time - np.diff(found.time, prepend=0.0), found.time[-1])
    axis.pcolormesh(edges, np.arange(11), found.codes.T, cmap=colours, vmin=-1.5, vmax=1.5)
    axis.set_yticks(np.arange(10) + 0.5, _CODES, fontsize=8)
    axis.invert_yaxis()
    axis.hlines((1, 4, 7), 0.0, END, color="white", lw=1.5)
    axis.set_xlim(0.0, END)
    axis.set_xticks(range(0, int(END) + 1, 2), [])
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    titled(axis, "Residual codes, band 5 % (Eqs 18-21)")
    names = ("-1: below the band", "0", "1: above")
    patches = [Patch(color=c, label=n) for c, n in zip(CODE_COLOURS, names, strict=True)]
    _key(axis, patches)


def _named(axis: Axes, judged: Mapping[str, Played]) -> None:
    """The named state over time, one strip for each judge."""
    seen = []
    for row, found in enumerate(judged.values()):
        starts = found.time - np.diff(found.time, prepend=0.0)
        for state in dict.fromkeys(found.states):
            if not state:
                continue
            seen += [state] if state not in seen else []
            inside = np.array([name == state for name in found.states])
            spans = [(starts[i], found.time[i] - starts[i]) for i in np.flatnonzero(inside)]
            colour = _STATE_COLOURS.get(state, _OTHER_COLOUR)
            axis.broken_barh(spans, (row + 0.04, 0.92), color=colour, lw=0)
    titled(axis, "Named state")
    _key(axis, [Patch(color=_STATE_COLOURS.get(s, _OTHER_COLOUR), label=s) for s in seen])
    axis.set_yticks((0.5, 1.5), [_JUDGES[name] for name in judged], fontsize=8)
    axis.set_ylim(len(judged), 0)
    axis.set_xlim(0.0, END)
    axis.set_xticks(range(0, int(END) + 1, 2))
    axis.tick_params(labelsize=8)
    axis.spines[["top", "right", "left"]].set_visible(False)
    axis.set_xlabel("time, s; shaded above: the four phases " + ", ".join(PHASES), fontsize=8)


def _key(axis: Axes, patches: list[Patch]) -> None:
    axis.legend(
        handles=patches,
        loc="lower right",
        bbox_to_anchor=(1.0, 0.98),
        ncols=len(patches),
        fontsize=8,
        frameon=False,
        borderaxespad=0.2,
    )


def _three_powers(found: Played) -> Figure:
    figure = page(10.0, 7.2)
    axes = figure.subplots(4, 1, sharex=True, height_ratios=(1.4, 1, 1, 0.55))
    for wheel, axis in enumerate(axes[:3]):
        curves = (
            ("measured", found.measured[:, wheel], MEASURED),
            ("modelled (from the command)", found.modelled[:, wheel], PHYSICAL),
            ("solved from encoder data", found.derived[:, wheel], DERIVED),
        )
        lines(axis, found.time, curves, 1.2)
        axis.set_ylabel("power, W")
        titled(axis, f"Motor {wheel + 1}" + (", its encoder lost" if wheel == 0 else ""))
        _mark_phases(axis)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=9, frameon=False)
    colours = ListedColormap(CODE_COLOURS)
    edges = np.append(found.time - np.diff(found.time, prepend=0.0), found.time[-1])
    rows = found.codes[:, [1, 4, 7]].T
    axes[3].pcolormesh(edges, np.arange(4), rows, cmap=colours, vmin=-1.5, vmax=1.5)
    axes[3].set_yticks(np.arange(3) + 0.5, [_CODES[index] for index in (1, 4, 7)], fontsize=8)
    axes[3].invert_yaxis()
    axes[3].spines[:].set_visible(False)
    axes[3].tick_params(length=0)
    titled(axes[3], "Residual codes of motor 1: orange above its band, blue below")
    axes[3].set_xlim(0.0, END)
    axes[3].set_xlabel("time, s; shaded: the four phases")
    return figure
