"""The comparison as text and picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from concealed.score import ORACLE_AIM
from rich.console import Console
from rich.table import Table

from others.compare import Row

METHODS = ("refit", "PySINDy", "tomr_gap")
_AIM = f"within {ORACLE_AIM:g} of the oracle"


def totals(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """By method: held-out error against the oracle's; what is claimed, and not so."""
    found = {}
    for method in METHODS:
        verdicts = [row.verdicts[method] for row in rows]
        nulls = [row.verdicts[method] for row in rows if row.null]
        after = [(row.verdicts[method].after, row.oracle) for row in rows]
        ratios = [value / oracle for value, oracle in after if value is not None]
        named = [item.named for item in verdicts if item.named is not None]
        found[method] = {
            "oracle ratio, median": float(np.median(ratios)) if ratios else None,
            "oracle ratio, largest": max(ratios, default=None),
            _AIM: f"{sum(ratio <= ORACLE_AIM for ratio in ratios)}/{len(ratios)}",
            "effects named": f"{sum(named)}/{sum(row.effects for row in rows)}" if named else None,
            "claims": sum(item.claims for item in verdicts),
            "false claims": sum(len(item.false) for item in verdicts),
            "cases with false claims": f"{sum(bool(item.false) for item in verdicts)}/{len(rows)}",
            "claims on nulls": sum(item.claims for item in nulls),
            "false claims on nulls": sum(len(item.false) for item in nulls),
        }
    return found


def show(console: Console, rows: Sequence[Row]) -> None:
    """Print a table of all cases, what each method says, and totals."""
    table = Table(title="NRMSE on the held-out drive; claims, and false ones", box=None)
    for heading in ("id", "concealed"):
        table.add_column(heading, no_wrap=True)
    for heading in ("simulation", *METHODS, "oracle", *(f"claims\n{name}" for name in METHODS)):
        table.add_column(heading, justify="right")
    table.add_column("refit: intervals\nwithout the truth", justify="right")
    table.add_column("farthest\n\\[half-widths]", justify="right")
    for row in rows:
        verdicts = [row.verdicts[method] for method in METHODS]
        table.add_row(
            row.identity,
            row.name,
            *(_any(x) for x in (row.before, *(item.after for item in verdicts), row.oracle)),
            *(f"{item.claims}, {len(item.false)}" for item in verdicts),
            f"{len(row.excluded)}/{row.parameters}",
            f"{max(row.excluded.values(), default=0.0):.1f}",
        )
    console.print(table)
    for row in rows:
        console.print(f"\n{row.identity}  {row.name}")
        for method in METHODS:
            console.print(f"  {method:9}{row.verdicts[method].says}", soft_wrap=True, markup=False)
    table = Table(title="\nTotals", box=None)
    for heading in ("", *METHODS):
        table.add_column(heading, justify="right" if heading else "left")
    found = totals(rows)
    for name in found[METHODS[0]]:
        table.add_row(name, *(_any(found[method][name]) for method in METHODS))
    console.print(table)


def _any(value: object) -> str:
    return "-" if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)


def draw(rows: Sequence[Row], path: Path) -> None:
    """Held-out NRMSE of all methods by case, as a picture."""
    from matplotlib.figure import Figure

    rows = sorted(rows, key=lambda row: row.before)
    series = {"simulation": [row.before for row in rows], "oracle": [row.oracle for row in rows]}
    styles = {"simulation": ("0.75", "s"), "oracle": ("k", "|")}
    for method, style in zip(METHODS, (("C1", "o"), ("C2", "^"), ("C0", "D")), strict=True):
        after = (row.verdicts[method].after for row in rows)
        series[method] = [np.nan if value is None else value for value in after]
        styles[method] = style
    figure = Figure(figsize=(8.0, 1.6 + 0.32 * len(rows)), dpi=120)
    axes = figure.subplots()
    for name, values in series.items():
        color, marker = styles[name]
        axes.plot(values, range(len(rows)), marker, color=color, label=name, markersize=7)
    axes.set_yticks(range(len(rows)), [f"{row.name}  {row.identity}" for row in rows], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlabel("NRMSE of power on the held-out drive")
    axes.grid(color="0.9", which="both")
    axes.legend(fontsize=8, loc="lower right")
    figure.savefig(path, bbox_inches="tight")
