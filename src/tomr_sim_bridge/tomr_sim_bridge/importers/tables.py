"""Tables of numbers as the Robotino data set keeps them: `;`-separated, three header lines."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.files import read_text

HEADER_LINES = 3  # description, unit, short name
SEPARATOR = ";"
TIME = "t"
_LARGEST = 1e12  # in any unit of the data set

Column = NDArray[np.float64]


@frozen
class Table:
    """The columns of one file by short name, each of shape (samples,), in the file's units."""

    place: str
    columns: Mapping[str, Column]

    def __getitem__(self, name: str) -> Column:
        """Return one column."""
        return self.columns[name]

    def stack(self, names: Sequence[str]) -> Column:
        """Return several columns side by side, shape (samples, len(names))."""
        return np.column_stack([self.columns[name] for name in names])


def read_table(path: Path, place: str, units: Mapping[str, str], optional: frozenset[str]) -> Table:
    """Read the columns named in `units`, which must be there in these units.

    Args:
        path: the file.
        place: how errors name the file.
        units: expected unit by short name, time `t` among them.
        optional: columns that may be absent, all of them together.

    Raises:
        InputError: unreadable or empty file, wrong columns or units, a cell that is no finite
            number, time that does not increase; with the line where there is one.
    """
    lines = _lines(path, place)
    names = _cells(lines[2])
    found = dict(zip(names, _cells(lines[1]), strict=False))
    wanted = dict(units) if optional & found.keys() else _without(units, optional)
    for name, unit in wanted.items():
        if name not in found:
            raise InputError(
                f"{place}: line 3 names no column {name!r}; "
                f"a file of the Robotino data set has {', '.join(wanted)}"
            )
        if found[name] != unit:
            raise InputError(
                f"{place}: line 2 gives column {name!r} in {found[name]!r}; expected {unit!r}"
            )
    rows = [
        _numbers(line, names, f"{place}: line {number}")
        for number, line in enumerate(lines[HEADER_LINES:], HEADER_LINES + 1)
        if line.strip()
    ]
    if not rows:
        raise InputError(f"{place} holds no samples after its header; download it again")
    data = np.asarray(rows, dtype=np.float64)
    _check_time(data[:, names.index(TIME)], place)
    return Table(place, {name: data[:, names.index(name)] for name in wanted})


def _lines(path: Path, place: str) -> list[str]:
    try:
        lines = read_text(path, "table_bytes", "utf-8-sig").splitlines()
    except InputError as error:
        raise InputError(f"{place}: {error}; download it again") from None
    if len(lines) < HEADER_LINES:
        raise InputError(
            f"{place} has {len(lines)} lines; a file of the Robotino data set begins with three "
            "header lines: download it again"
        )
    return lines


def _without(units: Mapping[str, str], optional: frozenset[str]) -> dict[str, str]:
    return {name: unit for name, unit in units.items() if name not in optional}


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().removesuffix(SEPARATOR).split(SEPARATOR)]


def _numbers(line: str, names: Sequence[str], place: str) -> list[float]:
    cells = _cells(line)
    if len(cells) != len(names):
        raise InputError(f"{place} has {len(cells)} cells, the header names {len(names)}")
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = float("nan")
        if not abs(number) <= _LARGEST:  # NaN is not
            raise InputError(
                f"{place}, column {name!r}: {cell[:40]!r} is not a finite number up to {_LARGEST:g}"
            )
        numbers.append(number)
    return numbers


def _check_time(time: Column, place: str) -> None:
    steps = np.diff(time)
    if (steps <= 0.0).any():
        row = int(np.argmax(steps <= 0.0))
        raise InputError(
            f"{place}: time does not increase from {time[row]:g} to {time[row + 1]:g} ms "
            f"(sample {row + 2}); sort the file or remove the sample"
        )
