"""The score as text, and the confusion matrix as text and picture."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from concealed.catalogue import SIZES
from concealed.likeness import family
from concealed.score import NOTHING, NULL, Hit, Outcome, Sighting
from concealed.unnamed import Met

_GROUP_COLUMNS = (
    "cases",
    "exact",
    "class",
    "verdict_right",
    "false_on_nulls",
    "false_on_others",
    "place",
    "parameter_error_median",
    "intervals_covering",
    "oracle_ratio_median",
)


def print_cases(console: Console, outcomes: Sequence[Outcome]) -> None:
    """One line per case."""
    table = Table(title="Cases", box=None)
    headings = ("id", "case", "verdict", "exact", "class", "place", "error", "covered")
    for heading in (*headings, "before", "after", "oracle", "s", "false discoveries"):
        right = heading not in ("id", "case", "verdict", "false discoveries")
        table.add_column(heading, justify="right" if right else "left", no_wrap=True)
    for outcome in outcomes:
        table.add_row(*_case_row(outcome))
    console.print(table)
    console.print("!: a wrong verdict; covered: intervals that hold the true value\n")


def _case_row(outcome: Outcome) -> list[str]:
    truth, compared = outcome.truth, [item for hit in outcome.hits for item in hit.comparisons]
    covered = [item.covered for item in compared if item.covered is not None]
    verdict = outcome.report.verdict if outcome.report else "(no report)"
    return [
        truth.identity,
        truth.name,
        verdict if outcome.verdict_right else f"!{verdict}",
        _of(sum(hit.exact for hit in outcome.hits), len(outcome.hits)),
        _of(sum(hit.alike for hit in outcome.hits), len(outcome.hits)),
        _number(outcome.place, 2),
        _number(max((item.error for item in compared), default=None), 3),
        _of(sum(covered), len(covered)),
        _number(truth.before, 3),
        _number(outcome.after, 3),
        _number(truth.oracle, 3),
        _number(outcome.seconds, 0),
        ", ".join(outcome.false) + (" (overconfident)" if outcome.overconfident else ""),
    ]


def print_groups(console: Console, groups: Mapping[str, Mapping[str, Any]]) -> None:
    """Totals by group."""
    table = Table(title="Groups", box=None)
    table.add_column("group", no_wrap=True)
    for column in _GROUP_COLUMNS:
        table.add_column(column.replace("_", " "), justify="right")
    for name, found in groups.items():
        table.add_row(name, *(_any(found[column]) for column in _GROUP_COLUMNS))
    console.print(table)


def print_sightings(console: Console, found: Sequence[Sighting]) -> None:
    """Detection limits: each effect at three sizes."""
    if not found:
        return
    table = Table(title="Detection: signal to noise per power sample, and how it was met", box=None)
    for heading in ("effect", *SIZES, "exact down to"):
        table.add_column(heading, no_wrap=True)
    for sighting in found:
        cells = [_met(sighting.met.get(size)) for size in SIZES]
        table.add_row(sighting.effect, *cells, sighting.limit or "-")
    console.print(table)
    console.print(
        "exact; class: of its family, or a rival; place: right name elsewhere; -: missed\n"
    )


def _met(hit: Hit | None) -> str:
    if hit is None:
        return ""
    how = "exact" if hit.exact else "place" if hit.named else "class" if hit.alike else "-"
    return f"{_number(hit.snr, 2):>6} {how}"


def print_confusion(console: Console, counts: Mapping[tuple[str, str], int]) -> None:
    """What was called by another name, or not at all."""
    table = Table(title="Confusion: true effect, and what it was called instead", box=None)
    for heading in ("true", "right", "called"):
        table.add_column(heading, no_wrap=heading != "called")
    for true in sorted({pair[0] for pair in counts}):
        right = NOTHING if true == NULL else true
        others = sorted(
            ((n, called) for (t, called), n in counts.items() if t == true and called != right),
            reverse=True,
        )
        total = sum(n for (t, _), n in counts.items() if t == true)
        listed = ", ".join(f"{called} {n}" for n, called in others)
        table.add_row(true, f"{counts.get((true, right), 0)}/{total}", listed)
    console.print(table)


def draw_confusion(counts: Mapping[tuple[str, str], int], path: Path) -> None:
    """Confusion matrix as a picture; framed cells are right, dashed ones of the same family."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    rows = _ordered({true for true, _ in counts})
    columns = _ordered({called for _, called in counts} | set(rows) - {NULL})
    matrix = np.zeros((len(rows), len(columns)))
    for (true, called), count in counts.items():
        matrix[rows.index(true), columns.index(called)] = count
    figure = Figure(figsize=(3.0 + 0.32 * len(columns), 2.5 + 0.3 * len(rows)), dpi=110)
    axes = figure.subplots()
    axes.imshow(matrix, cmap="Blues", vmin=0.0, aspect="auto")
    for row, true in enumerate(rows):
        for column, called in enumerate(columns):
            right = called == (NOTHING if true == NULL else true)
            if right or called in family(true):
                style = "-" if right else ":"
                place = (column - 0.5, row - 0.5)
                axes.add_patch(Rectangle(place, 1, 1, fill=False, linestyle=style, color="0.5"))
            if matrix[row, column]:
                dark = matrix[row, column] > 0.6 * matrix.max()
                axes.text(
                    column, row, f"{matrix[row, column]:.0f}",
                    ha="center", va="center", color="white" if dark else "black", fontsize=8,
                )  # fmt: skip
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.set_xlabel("called (solid frame: right, dotted: data can hardly distinguish)")
    axes.set_ylabel("concealed")
    figure.savefig(path, bbox_inches="tight")


def _ordered(names: set[str]) -> list[str]:
    last = (NULL, NOTHING)
    return sorted(names - set(last)) + [name for name in last if name in names]


def print_totals(console: Console, found: Mapping[str, Any]) -> None:
    """All totals, one a line."""
    table = Table(title="Totals", box=None, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(justify="right")
    for name, value in found.items():
        table.add_row(name.replace("_", " "), _any(value))
    console.print(table)


def print_unnamed(console: Console, found: Sequence[Met], figures: Mapping[str, Any]) -> None:
    """What has no name: one line per case, and the figures of all."""
    table = Table(title="Without a name", box=None)
    for heading in ("id", "case", "named as", "placed", "share", "comes and goes", "law"):
        table.add_column(heading, no_wrap=True)
    for item in found:
        marks = [
            "-" if said is None else "yes" if said else "no" for said in (item.repeats, item.law)
        ]
        share, placed = _number(item.share, 2), "yes" if item.placed else "no"
        table.add_row(item.truth.identity, item.truth.name, item.named, placed, share, *marks)
    console.print(table)
    for name, value in figures.items():
        console.print(f"{name}: {'-' if value is None else _any(value)}")


def _any(value: Any) -> str:
    if isinstance(value, tuple):
        return _of(*value)
    return str(value) if isinstance(value, int) else _number(value, 3)


def _of(count: int, total: int) -> str:
    return f"{count}/{total}" if total else "-"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
