"""Lines and areas over time as SVG paths, thinned out so that a page of an hour stays small."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEIGHT = 56  # of a panel, in its own units
_MOST_POINTS = 4000


@frozen
class Panel:
    """A strip of the time line, drawn in ms along x and 0 (top) to HEIGHT along y."""

    title: str
    low: float  # value at the bottom
    high: float  # and at the top
    unit: str
    lines: tuple[tuple[str, str], ...]  # (CSS class, path)
    area: str = ""  # path of the band
    values: tuple[tuple[str, list[float | None]], ...] = ()  # (name, value of each tick) to read

    @property
    def zero(self) -> float | None:
        """Where zero lies, None if outside."""
        if not self.low < 0.0 < self.high:
            return None
        return round(HEIGHT * self.high / (self.high - self.low), 1)


def scaled(values: Array, low: float, high: float) -> Array:
    """Values as heights; what lies beyond the panel is drawn at its edge."""
    share = (high - values) / (high - low)
    return np.clip(share, 0.0, 1.0) * HEIGHT


def line(ms: Array, height: Array) -> str:
    """A line through points, broken where a height is unknown."""
    ms, height = thinned(ms, height)
    words, pen = [], False
    for x, y in zip(ms.tolist(), height.tolist(), strict=True):
        if y != y:
            pen = False
            continue
        words.append(f"{'L' if pen else 'M'}{x:.0f} {y:.1f}")
        pen = True
    return "".join(words)


def area(ms: Array, top: Array, bottom: Array) -> str:
    """The area between two lines; where one is unknown there is none."""
    known = np.flatnonzero(np.isfinite(top) & np.isfinite(bottom))
    pieces = np.split(known, np.flatnonzero(np.diff(known) > 1) + 1) if len(known) else []
    words = []
    for piece in pieces:
        step = max(1, -(-len(ms) // _MOST_POINTS))
        rows = np.unique(np.append(piece[::step], piece[-1]))
        there = [f"{ms[k]:.0f} {top[k]:.1f}" for k in rows]
        back = [f"{ms[k]:.0f} {bottom[k]:.1f}" for k in rows[::-1]]
        words.append("M" + "L".join(there + back) + "Z")
    return "".join(words)


def thinned(ms: Array, values: Array) -> tuple[Array, Array]:
    """Not more points than a page can bear: the least and the greatest of each few."""
    step = -(-2 * len(ms) // _MOST_POINTS)
    if step <= 2:
        return ms, values
    rows: list[int] = []
    for begin in range(0, len(ms), step):
        part = values[begin : begin + step]
        if np.isnan(part).all():
            rows.append(begin)
        else:
            rows += sorted({begin + int(np.nanargmin(part)), begin + int(np.nanargmax(part))})
    return ms[rows], values[rows]


def reach(values: Array, least: float) -> float:
    """A limit that holds all but the few largest magnitudes."""
    known = np.abs(values[np.isfinite(values)])
    return max(least, 1.1 * float(np.quantile(known, 0.995))) if len(known) else least
