"""One stream of a recording as it is collected: rising stamps, within limits, without outliers."""

from array import array

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.limits import limits, too_large
from tomr_power_model.messages.plain import NANOSECONDS

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

_CLOCK_SPAN = 10.0  # s, that it takes to compare clocks
_STRAY = 0.01  # share of samples that may be stamped far from the others
_FEW = 5  # samples that may be, however few there are
_BACK = 0.1  # share of samples whose stamps may go back, or be none


class Series:
    """Rows with stamps; `finish` leaves those that rise, as the stages do."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._stamps = array("q")
        self._received = array("q")
        self._rows = array("d")
        self._times: Stamps = np.empty(0, np.int64)
        self._kept: NDArray[np.intp] = np.empty(0, np.intp)
        self.dropped = 0  # repeats and steps back
        self.strays = 0  # stamped far from the others

    def add(self, stamp_ns: int, receive_ns: int, *row: float) -> None:
        self._stamps.append(stamp_ns)
        self._received.append(receive_ns)
        self._rows.extend(row)

    def finish(self, place: str, jumps: bool) -> None:
        """Drop what repeats or goes back, and stray stamps where a stream has no long silences.

        Raises:
            InputError: too many samples, or stamps that jump for good or keep going back.
        """
        if len(self._stamps) > limits().samples:
            too_large(place, f"{len(self._stamps):,} samples", "samples")
        stamps = np.frombuffer(self._stamps, np.int64)
        kept = np.flatnonzero(stamps > 0)
        if jumps:
            near = kept[_together(stamps[kept], place)]
            self.strays = len(kept) - len(near)
            kept = near
        before = np.maximum.accumulate(np.concatenate([[0], stamps[kept]]))[:-1]
        back = len(stamps) - np.count_nonzero(stamps > 0) + np.count_nonzero(stamps[kept] < before)
        if back > max(_FEW, _BACK * len(stamps)):
            raise InputError(
                f"{place}: {100.0 * back / len(stamps):.0f} % of its stamps precede an earlier one "
                "or are none: no fit can rest on it; stamp by a clock that goes on, record again"
            )
        self._kept = kept[stamps[kept] > before]
        self.dropped = len(stamps) - len(self._kept) - self.strays
        self._times = stamps[self._kept]

    def __len__(self) -> int:
        return len(self._times)

    @property
    def first(self) -> int:
        return int(self._times[0])

    def since(self, start_ns: int) -> tuple[Array, Array]:
        """Times [s] since a stamp, and the rows."""
        rows = np.frombuffer(self._rows, np.float64).reshape(-1, self._width)
        return np.float64(1e-9) * (self._times - start_ns), rows[self._kept]

    def fast(self) -> float:
        """Part by which its clock runs faster than the recorder's; NaN where it is not known."""
        arrived = np.frombuffer(self._received, np.int64)[self._kept]
        received, stamped = 1e-9 * (arrived - arrived[0]), 1e-9 * (self._times - self._times[0])
        spread = received - received.mean()
        if min(np.ptp(received), np.ptp(stamped)) < _CLOCK_SPAN:
            return float("nan")
        return float(spread @ stamped / (spread @ spread)) - 1.0


def _together(stamps: Stamps, place: str) -> NDArray[np.bool_]:
    """Which samples are stamped near the most of them.

    Raises:
        InputError: too many are not, so that nothing shows which are right.
    """
    widest = limits().stamp_jump_seconds * NANOSECONDS
    order = np.argsort(stamps, kind="stable")
    steps = np.diff(stamps[order])
    if not len(steps) or steps.max() <= widest:
        return np.ones(len(stamps), dtype=bool)
    group = np.empty(len(stamps), np.intp)
    group[order] = np.concatenate([[0], np.cumsum(steps > widest)])
    near = group == np.bincount(group).argmax()
    if np.count_nonzero(~near) > max(_FEW, _STRAY * len(stamps)):
        raise InputError(
            f"{place}: its stamps jump by {steps.max() / NANOSECONDS:,.0f} s: cut the recording "
            "there, or set TOMR_LIMIT_STAMP_JUMP_SECONDS to take such silences for granted"
        )
    return np.asarray(near)
