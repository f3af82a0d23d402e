"""What an experiment gives: a picture, a small table and all its numbers."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from attrs import field, frozen
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from figures.page import save
from tomr_power_model.errors import InputError


class Missing(InputError):
    """An experiment needs what is not here: a data set, a library."""


@frozen
class Result:
    """An experiment's outcome; the first heading is that of the rows' names."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    numbers: dict[str, Any]
    picture: Figure | None = None
    notes: tuple[str, ...] = field(default=())

    def show(self, console: Console) -> None:
        """Print the table."""
        table = Table(title=self.title, title_justify="left", box=None)
        for index, heading in enumerate(self.headings):
            table.add_column(heading, justify="right" if index else "left", no_wrap=True)
        for row in self.rows:
            table.add_row(*row)
        console.print(table)
        for note in self.notes:
            console.print(note, highlight=False, soft_wrap=True)

    def write(self, folder: Path, name: str) -> list[Path]:
        """Write NAME.json, and NAME.png where there is a picture; returns what was written."""
        report = {"title": self.title, **self.numbers}
        written = [folder / f"{name}.json"]
        text = json.dumps(_known(report), indent=2, allow_nan=False)
        written[0].write_text(text + "\n", encoding="utf-8")
        if self.picture is not None:
            written.append(folder / f"{name}.png")
            save(self.picture, written[1])
        return written


def _known(value: Any) -> Any:
    """The same in six digits, and null for NaN, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _known(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_known(item) for item in value]
    if not isinstance(value, float):
        return value
    return float(f"{value:.6g}") if math.isfinite(value) else None
