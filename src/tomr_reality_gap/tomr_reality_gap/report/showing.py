"""Where a picture shows the mismatch best: which recording, channel and seconds."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.explanation import Comparison, Explanation, Finding

Array = NDArray[np.float64]

_PART = 0.06  # of the recording
_WINDOW = (4.0, 12.0)  # s
_MARGIN = 0.25  # of the window, shown on either side
_MOST = 25.0  # gain that one sample may count for: an outlier is not the mismatch


@frozen
class View:
    """One channel of one recording, zoomed."""

    comparison: Comparison
    channel: int
    window: tuple[float, float]  # s

    @property
    def name(self) -> str:
        """Of the channel."""
        return self.comparison.channels[self.channel].name


def leading(explanation: Explanation) -> Finding | None:
    """The finding that explains most."""
    return max(explanation.findings, key=lambda item: item.located.share, default=None)


def best_view(explanation: Explanation) -> View | None:
    """What shows the leading finding; without one, the largest residual."""
    comparison = next(
        (item for item in explanation.comparisons if not item.held_out),
        next(iter(explanation.comparisons), None),
    )
    if comparison is None or not comparison.channels:
        return None
    finding = leading(explanation)
    numbers = range(len(comparison.channels))
    gains = [_gain(comparison, number, finding is not None) for number in numbers]
    channel = _channel(comparison, finding, gains)
    intervals = finding.located.intervals if finding is not None else ()
    time = comparison.channels[channel].time
    return View(comparison, channel, _window(time, gains[channel], intervals))


def _gain(comparison: Comparison, number: int, found: bool) -> Array:
    """How much nearer to each measurement the simulation came, in squares of its noise."""
    value, sigma = comparison.channels[number].value, comparison.sigma[number]
    before = (value - comparison.before[number]) / sigma
    after = (value - comparison.after[number]) / sigma if found else np.zeros_like(before)
    return np.clip(np.nan_to_num(before**2 - after**2), -_MOST, _MOST)


def _channel(comparison: Comparison, finding: Finding | None, gains: Sequence[Array]) -> int:
    """The channel in which the finding shows; a power if the finding does not say."""
    if finding is not None:
        shares = [finding.located.channels.get(item.name, 0.0) for item in comparison.channels]
        if max(shares) > 0.0:
            return int(np.argmax(shares))
    kinds = [channel.kind for channel in comparison.channels]
    powers = [n for n, kind in enumerate(kinds) if kind in DRAWN_KINDS] or list(range(len(kinds)))
    return max(powers, key=lambda number: float(gains[number].sum()))


def _window(
    time: Array, gain: Array, intervals: Sequence[tuple[float, float]]
) -> tuple[float, float]:
    """Seconds that hold most of the gain, about one of the intervals if there are any."""
    length = float(np.clip(_PART * (time[-1] - time[0]), *_WINDOW))
    begins = time[time <= max(time[-1] - length, time[0])]
    middle = begins + 0.5 * length
    near = np.zeros(len(begins), dtype=bool)
    for start, end in intervals:
        near |= (middle >= start - 0.25 * length) & (middle <= end + 0.25 * length)
    if near.any():
        begins = begins[near]
    total = np.concatenate([[0.0], np.cumsum(gain)])
    held = total[np.searchsorted(time, begins + length)] - total[np.searchsorted(time, begins)]
    begin = float(begins[np.argmax(held)])
    margin = _MARGIN * length
    return max(begin - margin, float(time[0])), min(begin + length + margin, float(time[-1]))
