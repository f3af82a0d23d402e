"""The explanation as one page of HTML that needs nothing beside it, read from the top."""

import math
from collections.abc import Callable, Mapping
from importlib.resources import files

import numpy as np
from attrs import frozen
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.explanation import Comparison, Explanation, Finding
from tomr_reality_gap.report import figures, residuals
from tomr_reality_gap.report.showing import best_view
from tomr_reality_gap.report.unnamed import unnamed_picture
from tomr_reality_gap.report.words import (
    effect_words,
    estimate_words,
    number_words,
    percent_words,
    place_words,
    shortened,
    title,
)

_MOST_DRIVES = 4  # with a picture each
_MOST_MAPS = 6
_MOST_CHANNELS = 3  # named beside a finding
_LEAST_SHARE = 0.01

Tick = Callable[[], None]
Array = NDArray[np.float64]


@frozen
class ChannelLine:
    """How well one channel of one recording is simulated."""

    recording: str
    held_out: bool
    channel: str
    unit: str
    rms: tuple[float, float]  # of the residual, before and after
    nrmse: tuple[float, float]
    level: tuple[float, float]  # RMS of residual / sigma; 1 is noise


def report_page(explanation: Explanation, robot: str, tick: Tick = lambda: None) -> str:
    """The page as HTML; `robot` names its description, `tick` is called after each picture."""
    found = bool(explanation.findings)
    return rendered(
        "report/report.html.j2",
        explanation=explanation,
        robot=robot,
        found=found,
        rows=[_row(finding) for finding in explanation.findings],
        lines=channel_lines(explanation.comparisons),
        **_pictures(explanation, found, tick),
    )


def picture_count(explanation: Explanation) -> int:
    """How often `tick` will be called."""
    shapes = sum(finding.shape is not None for finding in explanation.findings)
    drives = min(_MOST_DRIVES, len(_drives(explanation)))
    shown = 1 if best_view(explanation) is not None else 0
    left = 2 if explanation.comparisons else 0
    return shown + shapes + min(_MOST_MAPS, len(explanation.maps)) + drives + left


def channel_lines(comparisons: tuple[Comparison, ...]) -> list[ChannelLine]:
    """Figures of all channels, held-out recordings first."""
    return [
        ChannelLine(
            recording=one.name,
            held_out=one.held_out,
            channel=channel.name,
            unit=channel.unit,
            rms=_pair(channel.value, one, number, 1.0),
            nrmse=_pair(channel.value, one, number, _spread(channel)),
            level=_pair(channel.value, one, number, one.sigma[number]),
        )
        for one in sorted(comparisons, key=lambda item: not item.held_out)
        for number, channel in enumerate(one.channels)
    ]


def _spread(channel: Channel) -> float:
    """Standard deviation; none of a supply's voltage, which is not meant to vary."""
    return math.nan if channel.kind == "voltage" else float(np.std(channel.value))


def _pair(value: Array, one: Comparison, number: int, scale: float) -> tuple[float, float]:
    """RMS of measured - simulated over a scale, before and after; NaN where the scale is 0."""
    before, after = (
        float(np.sqrt(np.mean((value - simulated[number]) ** 2))) / (scale or math.nan)
        for simulated in (one.before, one.after)
    )
    return before, after


def rendered(template: str, **values: object) -> str:
    """A page of this package from its template and what that shows."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters.update(
        number=number_words,
        percent=percent_words,
        effect=effect_words,
        place=place_words,
        shortened=shortened,
    )
    text = files("tomr_reality_gap").joinpath(template).read_text(encoding="utf-8")
    return environment.from_string(text).render(values)


def _row(finding: Finding) -> Mapping[str, object]:
    """A finding, ready to be shown."""
    return {
        "finding": finding,
        "title": title(finding),
        "parameters": [
            (name, estimate_words(estimate)) for name, estimate in finding.parameters.items()
        ],
        "channels": _main_channels(finding.located.channels),
    }


def _main_channels(shares: Mapping[str, float]) -> list[tuple[str, float]]:
    """The few channels that hold a percent or more, the largest share first."""
    shown = [item for item in shares.items() if item[1] >= _LEAST_SHARE]
    return sorted(shown, key=lambda item: -item[1])[:_MOST_CHANNELS]


def _drives(explanation: Explanation) -> list[Comparison]:
    """Recordings to show over time: those held out; without any those explained."""
    held_out = [item for item in explanation.comparisons if item.held_out]
    return held_out or list(explanation.comparisons)


def _pictures(explanation: Explanation, found: bool, tick: Tick) -> dict[str, object]:
    def drawn(picture: str) -> str:
        tick()
        return picture

    drives = _drives(explanation)
    view = best_view(explanation)
    maps = sorted(explanation.maps, key=lambda item: -figures.map_weight(item, found))[:_MOST_MAPS]
    return {
        "view": view,
        "picture": drawn(figures.show(view, explanation)) if view is not None else "",
        "shapes": [
            (finding.shape, drawn(unnamed_picture(finding.shape, finding.learnt)))
            for finding in explanation.findings
            if finding.shape is not None
        ],
        "maps": [(item.variable, drawn(figures.map_picture(item, found))) for item in maps],
        "drives": [
            (item.name, drawn(figures.over_time(item, found))) for item in drives[:_MOST_DRIVES]
        ],
        "left_out": max(0, len(drives) - _MOST_DRIVES),
        "held_out": bool(drives) and drives[0].held_out,
        "residuals": drawn(residuals.residuals(drives, found)) if drives else "",
        "whiteness": drawn(residuals.whiteness(drives, found)) if drives else "",
    }
