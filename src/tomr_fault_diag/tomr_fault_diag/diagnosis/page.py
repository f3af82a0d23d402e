"""A recording's time line as one page of HTML that needs nothing beside it, and a page of all."""

import json
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from attrs import frozen
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import FAULTLESS, NORMAL, STATES
from tomr_fault_diag.diagnosis.labels import Label, split_state
from tomr_fault_diag.diagnosis.replayed import Failed, Replayed
from tomr_fault_diag.diagnosis.summary import UNDECIDED
from tomr_fault_diag.diagnosis.svg import HEIGHT, Panel, area, line, reach, scaled
from tomr_fault_diag.diagnosis.track import Health, Track
from tomr_fault_diag.diagnosis.words import notes, score_lines, seconds, total_line, verdict
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL
from tomr_power_model.messages.plain import NANOSECONDS, Level

Array = NDArray[np.float64]

INDEX = "index.html"
_MOST_BANDS = 6.0  # of a residual's panel
_MOST_READ = 12_000  # ticks whose values can be read under the pointer
_NORMAL_COLOUR = "#69b578"
_LEVEL_COLOURS = {
    Level.OK: "#d5ead9",
    Level.WARN: "#f77f00",
    Level.ERROR: "#d62828",
    Level.STALE: "#90a4ae",
}
_QUIET_COLOURS = {
    "not observable in this motion": "#cfd8dc",
    "waiting": "#e6e9ec",
    "stale": "#90a4ae",
}
_FAULT_COLOURS = {
    "slip": "#f2a104",
    "control system fault": "#d62828",
    "motor system fault": "#7b2cbf",
    "does not follow its commands": "#111827",
    "low supply": "#b45309",
    "unknown": "#f77f00",
    "power sensor fault": "#0077b6",
    "dragging wheel": "#a0522d",
    "stuck wheel": "#6d071a",
    "degraded motor": "#b5179e",
    "external load": "#bc6c25",
}
_OTHER_COLOURS = ("#4361ee", "#2a9d8f", "#8d99ae", "#e07a5f", "#5f0f40", "#335c67")


@frozen
class Bar:
    """A state over a while of a strip [ms]."""

    title: str
    begin: int
    length: int
    colour: str
    is_fault: bool


@frozen
class Strip:
    """Bars of one kind."""

    title: str
    bars: tuple[Bar, ...]


def colour_of(state: str) -> str:
    """The same colour for a state on every page."""
    name, _ = split_state(state)
    if name == STATES[NORMAL].name:
        return _NORMAL_COLOUR
    known = {**_QUIET_COLOURS, **_FAULT_COLOURS}
    if name in known:
        return known[name]
    if name in FAULTLESS or name in UNDECIDED:
        return "#b7c9bd"
    return _OTHER_COLOURS[sum(name.encode()) % len(_OTHER_COLOURS)]


def time_line(
    found: Replayed, tracks: Sequence[Track], labels: Sequence[Label], wheels: Sequence[str]
) -> str:
    """The page of one recording; `wheels` are the names of the wheels' topics."""
    first = tracks[0]
    start, length = found.start_ns, max(1, (found.end_ns - found.start_ns) // 1_000_000)
    ms = (first.stamp_ns - start) / 1e6
    strips = [_said(track, start, number, len(tracks)) for number, track in enumerate(tracks)]
    strips = [*_true(labels, start, length), *strips]
    inputs = [_input(topic, changes, start, length) for topic, changes in first.inputs.items()]
    panels = _panels(first, ms, wheels) if len(ms) else []
    step = -(-len(ms) // _MOST_READ) if len(ms) else 1
    data = {
        "length": length,
        "ms": np.round(ms[::step]).astype(int).tolist(),
        "values": [[(name, values[::step]) for name, values in panel.values] for panel in panels],
    }
    return _rendered(
        "page.html.j2",
        found=found,
        title=found.task.bag.name,
        verdict=verdict(found),
        strips=strips,
        inputs=inputs,
        legend=_legend(strips),
        panels=panels,
        height=HEIGHT,
        length=length,
        ticks=_axis(length),
        episodes=[_episode(episode, start) for episode in found.phases[0].summary.episodes],
        conditions=[change.words for change in found.phases[0].summary.conditions],
        streams=_streams(found),
        notes=list(notes(found)),
        data=json.dumps(data, separators=(",", ":")),
    )


def index_page(
    done: Sequence[Replayed], failed: Sequence[Failed], scores: Mapping[str, Any] | None
) -> str:
    """The page of all recordings, with links to each."""
    rows = [
        {
            "bag": str(item.task.bag),
            "page": item.task.page.name if item.task.page else "",
            "seconds": seconds(item.end_ns, item.start_ns),
            "bars": _said_briefly(item),
            "verdict": verdict(item),
            "is_fault": item.has_fault,
        }
        for item in done
    ]
    return _rendered(
        "index.html.j2",
        total=total_line(done, failed),
        rows=rows,
        failed=failed,
        scores=list(score_lines(dict(scores))) if scores else [],
    )


def _rendered(template: str, **values: object) -> str:
    text = files("tomr_fault_diag.diagnosis").joinpath(template).read_text(encoding="utf-8")
    return Environment(autoescape=True, undefined=StrictUndefined).from_string(text).render(values)


def _said(track: Track, start_ns: int, number: int, count: int) -> Strip:
    """The states of a phase, one bar for as long as each stood."""
    title = "diagnosis" if count == 1 else f"phase {number + 1} of {count}"
    bars, begin = [], 0
    ms = ((track.stamp_ns - start_ns) // 1_000_000).tolist()
    for tick, said in enumerate(track.said):
        if tick + 1 < len(ms) and track.said[tick + 1].state == said.state:
            continue
        end = ms[tick + 1] if tick + 1 < len(ms) else ms[tick]
        bars.append(_bar(said.state, ms[begin], end))
        begin = tick + 1
    return Strip(title, tuple(bars))


def _true(labels: Sequence[Label], start_ns: int, length: int) -> list[Strip]:
    if not labels:
        return []
    bars = []
    for label in (item.times(start_ns) for item in labels):
        end = length if label.end is None else min(length, round(1000 * label.end))
        wheel = f" {label.wheel}" if label.wheel else ""
        bars.append(_bar(f"{label.state}{wheel}", round(1000 * label.onset), end, label.title))
    return [Strip("true", tuple(bars))]


def _input(topic: str, changes: Sequence[Health], start_ns: int, length: int) -> Strip:
    """How an input did, one bar for as long as its level stood."""
    ms = [(change.stamp_ns - start_ns) // 1_000_000 for change in changes]
    bars = [
        Bar(
            f"{topic}: {change.words}, {begin / 1000:.2f} to {end / 1000:.2f} s",
            begin,
            max(1, end - begin),
            _LEVEL_COLOURS[change.level],
            change.level != Level.OK,
        )
        for change, begin, end in zip(changes, ms, [*ms[1:], length], strict=True)
    ]
    return Strip(topic, tuple(bars))


def _bar(state: str, begin: int, end: int, title: str = "") -> Bar:
    words = f"{title or state}: {begin / 1000:.2f} to {end / 1000:.2f} s"
    return Bar(words, begin, max(1, end - begin), colour_of(state), state not in FAULTLESS)


def _said_briefly(item: Replayed) -> list[dict[str, object]]:
    """The first phase as bars in percent of the recording."""
    length = max(1, item.end_ns - item.start_ns)
    return [
        {
            "left": round(100 * (episode.start_ns - item.start_ns) / length, 3),
            "width": round(100 * max(episode.end_ns - episode.start_ns, 5e7) / length, 3),
            "colour": colour_of(episode.state),
            "title": episode.words,
        }
        for episode in item.phases[0].summary.episodes
    ]


def _legend(strips: Sequence[Strip]) -> list[tuple[str, str]]:
    found: dict[str, str] = {}
    for strip in strips:
        for bar in strip.bars:
            found.setdefault(bar.title.rpartition(": ")[0], bar.colour)
    return list(found.items())


def _axis(length: int) -> list[tuple[float, str]]:
    """Places [%] and labels of the time axis."""
    rough = length / 8000.0
    power = 10.0 ** math.floor(math.log10(max(rough, 1e-3)))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough)
    count = int(length / 1000.0 / step)
    return [(100.0 * n * step * 1000.0 / length, f"{n * step:g} s") for n in range(count + 1)]


def _panels(track: Track, ms: Array, wheels: Sequence[str]) -> list[Panel]:
    panels = [_probability(track, ms)]
    panels.append(_residual("total power: measured - modelled", "W", track, TOTAL, ms))
    for index, wheel in zip(MOTORS, wheels, strict=True):
        panels.append(_compared(f"{wheel} power", "W", track, index, ms))
        panels.append(_residual(f"{wheel} power: measured - modelled", "W", track, index, ms))
    for index, wheel in zip(SPEEDS, wheels, strict=True):
        panels.append(_compared(f"{wheel} speed", "rad/s", track, index, ms))
        panels.append(_residual(f"{wheel} speed: measured - expected", "rad/s", track, index, ms))
    for index, wheel in zip(ENCODERS, wheels, strict=True):
        panels.append(_residual(f"{wheel} power against encoders", "W", track, index, ms))
    return panels


def _probability(track: Track, ms: Array) -> Panel:
    path = line(ms, scaled(track.probability, -0.05, 1.05))
    values = (("p", _numbers(track.probability)),)
    return Panel(
        "probability of the state named", -0.05, 1.05, "", (("measured", path),), "", values
    )


def _residual(title: str, unit: str, track: Track, index: int, ms: Array) -> Panel:
    """A residual in its band; what lies outside is drawn once more, in red."""
    residual, band = track.residual[:, index], track.band[:, index]
    known = band[np.isfinite(band)]
    usual = float(np.quantile(known, 0.9)) if len(known) else 1.0
    # So that the band stays visible beside a fault, what lies far beyond is drawn at the edge.
    limit = min(reach(residual, 1.5 * usual), _MOST_BANDS * usual)
    outside = np.where(np.abs(residual) > band, residual, np.nan)
    return Panel(
        title,
        -limit,
        limit,
        unit,
        (
            ("measured", line(ms, scaled(residual, -limit, limit))),
            ("outside", line(ms, scaled(outside, -limit, limit))),
        ),
        area(ms, scaled(band, -limit, limit), scaled(-band, -limit, limit)),
        (("residual", _numbers(residual)), ("band", _numbers(band))),
    )


def _compared(title: str, unit: str, track: Track, index: int, ms: Array) -> Panel:
    """What was measured, and what the model expects."""
    modelled = track.modelled[:, index]
    way = np.where(modelled < 0.0, -1.0, 1.0) if index in SPEEDS else 1.0
    measured = modelled + way * track.residual[:, index]
    both = np.concatenate([measured, modelled])
    known = both[np.isfinite(both)]
    low, high = np.quantile(known, [0.002, 0.998]) if len(known) else (0.0, 1.0)
    margin = 0.08 * float(high - low) + 1e-3
    low, high = min(0.0, float(low)) - margin, max(0.0, float(high)) + margin
    return Panel(
        title,
        low,
        high,
        unit,
        (
            ("modelled", line(ms, scaled(modelled, low, high))),
            ("measured", line(ms, scaled(measured, low, high))),
        ),
        "",
        (("measured", _numbers(measured)), ("modelled", _numbers(modelled))),
    )


def _numbers(values: Array) -> list[float | None]:
    return [float(f"{value:.4g}") if value == value else None for value in values.tolist()]


def _episode(episode: Any, start_ns: int) -> dict[str, object]:
    return {
        "state": episode.words,
        "begin": seconds(episode.start_ns, start_ns),
        "end": seconds(episode.end_ns, start_ns),
        "since": seconds(episode.since_ns, start_ns),
        "evidence": episode.evidence,
        "severity": episode.severity.words if episode.severity else "",
        "colour": colour_of(episode.state),
        "is_fault": episode.is_fault,
    }


def _streams(found: Replayed) -> list[tuple[str, int, float, float]]:
    """Topic, messages, mean rate [Hz], longest silence [s]."""
    length = max(1, found.end_ns - found.start_ns)
    return [
        (name, item.count, item.count * NANOSECONDS / length, item.silence_ns / NANOSECONDS)
        for name, item in sorted(found.streams.items())
    ]
