"""Trials of faults in ever smaller sizes, and the detection floors that they amount to."""

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from attrs import frozen

from tomr_commission.evidence import Episode


@frozen
class Trial:
    """One fault of a size at a wheel, and what was said of it."""

    kind: str
    size: float
    unit: str
    wheel: int
    delay: float | None  # s from its beginning to the first alarm; None: not found
    called: str  # what it was called, empty where it was not found

    @classmethod
    def of(
        cls, kind: str, size: float, unit: str, *, wheel: int, begin: float, alarm: Episode | None
    ) -> Self:
        """Of a fault that began at a time [s], and the first alarm since."""
        if alarm is None:
            return cls(kind, size, unit, wheel, None, "")
        return cls(kind, size, unit, wheel, alarm.begin - begin, alarm.state)


def smallest_found(sizes: Sequence[float], attempt: Callable[[float], Trial]) -> list[Trial]:
    """Trials that find the smallest size that is found, by bisection; sizes the largest first."""
    trials = []
    first, last = 0, len(sizes)  # sizes before `first` are found, from `last` on they are not
    while first < last:
        middle = (first + last) // 2
        trials.append(attempt(sizes[middle]))
        if trials[-1].delay is None:
            last = middle
        else:
            first = middle + 1
    return trials


@frozen
class Floor:
    """The smallest size of a kind of fault that was found at every wheel, and at some."""

    kind: str
    unit: str
    everywhere: float | None
    somewhere: float | None
    wheel: int | None  # 1..3, at which `somewhere` was found
    largest: float  # that was tried
    delay: float | None  # s, median of all that were found
    called: str

    @property
    def words(self) -> str:
        """The smallest size that is found at every wheel; one that has no size is just found."""
        if self.everywhere is None:
            where = "not found at every wheel" if self.somewhere is not None else "not found"
            return f"{where} up to {self.largest:g} {self.unit}" if self.unit else where
        return f"{self.everywhere:g} {self.unit}" if self.unit else "found"

    @property
    def best(self) -> str:
        """That at the wheel where it is seen best."""
        if self.somewhere is None:
            return "not found"
        size = f"{self.somewhere:g} {self.unit}" if self.unit else "found"
        return size if self.somewhere == self.everywhere else f"{size}, wheel {self.wheel}"


def floors_of(trials: Sequence[Trial]) -> list[Floor]:
    """Detection floors by kind."""
    by_kind: dict[str, list[Trial]] = {}
    for trial in trials:
        by_kind.setdefault(trial.kind, []).append(trial)
    return [_floor(kind, rows) for kind, rows in by_kind.items()]


def _floor(kind: str, rows: Sequence[Trial]) -> Floor:
    smallest: dict[int, float] = {}
    for row in rows:
        if row.delay is not None:
            smallest[row.wheel] = min(row.size, smallest.get(row.wheel, row.size))
    best = min(smallest, key=lambda wheel: smallest[wheel], default=None)
    delays = [row.delay for row in rows if row.delay is not None]
    names = [name for row in rows for name in row.called.split(", ") if name]
    return Floor(
        kind,
        rows[0].unit,
        max(smallest.values()) if smallest.keys() == {row.wheel for row in rows} else None,
        None if best is None else smallest[best],
        None if best is None else best + 1,
        max(row.size for row in rows),
        float(np.median(delays)) if delays else None,
        ", ".join(dict.fromkeys(sorted(names, key=lambda name: -names.count(name)))),
    )
