"""The time line of a drive: power, residuals, what was true and what was named, as PNG."""

from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from attrs import frozen
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from tomr_demo.score import Stretch
from tomr_demo.series import Drive, Power
from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP, STATES
from tomr_power_model.drive.motion import median_period
from tomr_power_model.files.write import write_bytes
from tomr_power_model.messages.plain import NANOSECONDS

DPI = 130
SIZE = (14.0, 11.5)  # inches
_HEIGHTS = (1.1, 1.5, 1.5, 1.5, 1.5, 3.1)  # strips, three motors, total, residuals

_INK = "#22262b"
_MUTED = "#6b727b"
_PREDICTED = "#e07b00"
_PASSED, _FAILED = "#1c7c3c", "#b3261e"
_SMALL = 8.5  # points
_STATE_COLOURS = {
    STATES[NORMAL].name: "#b9dcb8",
    STATES[SLIP].name: "#8cb8e8",
    STATES[CONTROL].name: "#cba6e3",
    **dict(zip((s.name for s in STATES[MOTOR:]), ("#f09a8f", "#f2b48a", "#e88fb2"), strict=True)),
}
_UNKNOWN_COLOUR = "#d5d8dc"
_TINT = 0.13  # opacity of a state's colour behind the curves
_EDGES = (-5.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 5.0)  # of residual / band
_SHADES = ("#1f5fa8", "#5b97d1", "#a9cbe8", "#f6f6f4", "#f3b7a0", "#dd6f52", "#a82a22")
_LETTERS = 150  # that fit on one line of a strip


@frozen
class _Block:
    """A state from a time to another [s]."""

    begin: float
    end: float
    state: str
    label: str

    @property
    def colour(self) -> str:
        return _STATE_COLOURS.get(self.state, _UNKNOWN_COLOUR)


def save_figure(drive: Drive, path: Path) -> None:
    """Draw a drive. Raises InputError if the file cannot be written."""
    layout = ConstrainedLayoutEngine(h_pad=0.03, w_pad=0.06, hspace=0.02)
    figure = Figure(figsize=SIZE, dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    rows = figure.subplots(len(_HEIGHTS), 1, sharex=True, height_ratios=_HEIGHTS)
    strips, *powers, residuals = rows
    _strips(strips, drive)
    limits = _limits(drive.power[:-1]), _limits(drive.power[-1:])
    for axis, power in zip(powers, drive.power, strict=True):
        _power(axis, power, limits[power is drive.power[-1]])
    strips.legend(
        *powers[0].get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=2,
        fontsize=9,
        frameon=False,
        borderaxespad=0.2,
    )
    _residuals(figure, residuals, drive)
    for axis in rows:
        _finish(axis, drive)
    for axis in (*powers, residuals):
        _mark_stretches(axis, drive, tinted=axis is not residuals)
    residuals.set_xlabel("time since the start of the drive [s]", fontsize=9, color=_INK)
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    write_bytes(path, drawn.getvalue())


def _blocks(drive: Drive) -> tuple[list[_Block], list[_Block]]:
    """What was true, and what was named, each as blocks one after the other."""
    true = [
        _Block(
            drive.seconds(stretch.start_ns),
            drive.seconds(stretch.end_ns or drive.board.now_ns),
            stretch.expected,
            stretch.title,
        )
        for stretch in drive.board.stretches
    ]
    marks = [(drive.seconds(named.stamp_ns), named.state) for named in drive.board.named]
    if marks:  # repeated once a second: what the first one says may have held since long before
        marks[0] = (max(0.0, drive.seconds(drive.board.named[0].since_ns)), marks[0][1])
    named: list[_Block] = []
    for (begin, state), (end, _) in pairwise([*marks, (drive.end, "")]):
        start = named.pop().begin if named and named[-1].state == state else begin
        named.append(_Block(start, end, state, state))
    return true, named


def _strips(axis: Axes, drive: Drive) -> None:
    """What was true above what was named, and how late it was named."""
    axis.set_title(
        "From the power of the motors to the fault",
        loc="left",
        fontsize=14,
        fontweight="bold",
        color=_INK,
        pad=8,
    )
    for place, blocks in zip((1.0, 0.0), _blocks(drive), strict=True):
        for block in blocks:
            span = (block.begin, block.end - block.begin)
            axis.broken_barh([span], (place + 0.05, 0.9), color=block.colour, lw=0)
            _words(axis, block, place + 0.5, span[1] / drive.end)
    for stretch in drive.board.stretches:
        if stretch.fault_id is not None:
            _delay(axis, drive, stretch)
    axis.set_ylim(-0.7, 2.0)
    axis.set_yticks([1.5, 0.5], ["true", "named"])


def _words(axis: Axes, block: _Block, height: float, share: float) -> None:
    """Words in a block: on two lines where they would not fit on one, none in a narrow block."""
    words, room = block.label, _LETTERS * share
    if len(words) > room and " " in words:
        gaps = [place for place, letter in enumerate(words) if letter == " "]
        middle = min(gaps, key=lambda place: abs(place - len(words) / 2))
        words = f"{words[:middle]}\n{words[middle + 1 :]}"
    if max(len(line) for line in words.splitlines()) <= room:
        axis.text(
            (block.begin + block.end) / 2,
            height,
            words,
            ha="center",
            va="center",
            linespacing=0.95,
            fontsize=_SMALL,
            color=_INK,
        )


def _delay(axis: Axes, drive: Drive, stretch: Stretch) -> None:
    """How long after its onset a fault was named."""
    delay = stretch.delay_ns
    text = "not named" if delay is None else f"named after {delay / NANOSECONDS:.2f} s"
    colour = _PASSED if stretch.passed(drive.board.now_ns) else _FAILED
    begin = drive.seconds(stretch.start_ns)
    axis.text(begin, -0.35, text, va="center", fontsize=_SMALL, color=colour, weight="bold")


def _limits(powers: tuple[Power, ...]) -> tuple[float, float]:
    """Range of an axis [W], made for what is predicted."""
    predicted = np.concatenate([power.predicted.value for power in powers])
    known = predicted[np.isfinite(predicted)]
    if not len(known):
        return -10.0, 30.0
    low, high = float(known.min()), float(known.max())
    room = max(high - low, 5.0)
    return low - 0.4 * room, high + 0.8 * room


def _power(axis: Axes, power: Power, limits: tuple[float, float]) -> None:
    """Measured power of a supply, and what the command lets expect."""
    measured, predicted = power.measured, power.predicted
    axis.plot(measured.time, measured.value, color=_INK, lw=0.8, label="measured")
    axis.plot(
        predicted.time, predicted.value, color=_PREDICTED, lw=1.6, label="predicted from cmd_vel"
    )
    axis.axhline(0.0, color=_MUTED, lw=0.5)
    axis.set_ylim(*limits)
    known = measured.value[np.isfinite(measured.value)]
    low, high = (float(known.min()), float(known.max())) if len(known) else limits
    if low < limits[0] or high > limits[1]:
        axis.text(
            0.995,
            0.97,
            f"measured from {low:.0f} W to {high:.0f} W",
            transform=axis.transAxes,
            ha="right",
            va="top",
            fontsize=_SMALL,
            color=_MUTED,
            bbox={"facecolor": "white", "alpha": 0.85, "lw": 0, "pad": 1.5},
        )
    axis.set_ylabel(f"{power.name.replace('_', ' ')}\npower [W]", fontsize=9, color=_INK)


def _residuals(figure: Figure, axis: Axes, drive: Drive) -> None:
    """Heat map of residual / band, nearly white within the band."""
    names = drive.residual_names
    axis.set_ylim(len(names), 0)
    axis.set_yticks(np.arange(len(names)) + 0.5, [name.replace("_", " ") for name in names])
    for border in (1, 4, 7):
        axis.axhline(border, color="white", lw=2.5, zorder=3)
    if len(drive.residual_time) < 2:
        return
    period = median_period(drive.residual_time)
    mesh = axis.pcolormesh(
        np.append(drive.residual_time - period, drive.residual_time[-1]),
        np.arange(len(names) + 1),
        np.clip(np.ma.masked_invalid(drive.residual_share.T), _EDGES[0], _EDGES[-1] - 0.01),
        cmap=ListedColormap(_SHADES).with_extremes(bad=_UNKNOWN_COLOUR),
        norm=BoundaryNorm(_EDGES, len(_SHADES)),
        rasterized=True,
    )
    bar = figure.colorbar(mesh, ax=axis, ticks=_EDGES[1:-1], pad=0.01, aspect=18, fraction=0.03)
    bar.set_label("(measured - modelled) / band", fontsize=9, color=_INK)
    bar.ax.tick_params(labelsize=8, colors=_MUTED, length=0)
    bar.outline.set_visible(False)


def _mark_stretches(axis: Axes, drive: Drive, tinted: bool) -> None:
    """Where the truth changed, and on request the colour of each fault behind the curves."""
    for index, stretch in enumerate(drive.board.stretches):
        begin = drive.seconds(stretch.start_ns)
        end = drive.seconds(stretch.end_ns or drive.board.now_ns)
        if index > 0:
            axis.axvline(begin, color=_MUTED, lw=0.8, ls=(0, (4, 3)))
        if tinted and stretch.fault_id is not None:
            colour = _STATE_COLOURS.get(stretch.expected, _UNKNOWN_COLOUR)
            axis.axvspan(begin, end, color=colour, alpha=_TINT, lw=0)


def _finish(axis: Axes, drive: Drive) -> None:
    axis.set_xlim(0.0, drive.end)
    axis.tick_params(labelsize=_SMALL, colors=_MUTED, length=0)
    for label in axis.get_yticklabels():
        label.set_color(_INK)
    for side in axis.spines.values():
        side.set_visible(False)
