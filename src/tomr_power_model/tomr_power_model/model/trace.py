"""Simulated steps of the last moments, read as sensors do: over the windows before stamps."""

import math
from collections import deque
from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.effects import PlantNumbers

Value = tuple[float, float]  # mean over a step, and its change within it


@frozen
class _Step:
    start: int  # ns
    length: int  # ns
    values: tuple[Value, ...]


def _part(value: Value, share: float) -> float:
    """Integral over the first part of a step, in steps: straight through the mean."""
    return share * value[0] - 0.5 * share * (1.0 - share) * value[1]


class Trace:
    """Some quantities of the last moments, one column each."""

    def __init__(self, keep_ns: int) -> None:
        self._keep = keep_ns
        self._steps: deque[_Step] = deque()

    def clear(self) -> None:
        """Forget all steps."""
        self._steps.clear()

    def add(self, start: int, length: int, values: Sequence[Value]) -> None:
        """Take the next step: when it began and how long it lasted [ns]."""
        self._steps.append(_Step(start, length, tuple(values)))
        while self._steps[0].start < start - self._keep:
            self._steps.popleft()

    def mean(self, column: int, end: int, window: int) -> float:
        """Mean over the window that ends at a time [ns], of what of it was simulated; else NaN."""
        begin, total, covered = end - window, 0.0, 0
        for step in reversed(self._steps):
            first, last = max(begin, step.start), min(end, step.start + step.length)
            if last > first:
                value, length = step.values[column], step.length
                shares = (last - step.start) / length, (first - step.start) / length
                total += length * (_part(value, shares[0]) - _part(value, shares[1]))
                covered += last - first
            if step.start <= begin:
                break
        return total / covered if covered else math.nan


class Monitor:
    """A wheel's power sensor: lag, clock offset, scale and bias."""

    def __init__(self, numbers: PlantNumbers, wheel: int) -> None:
        self._lag = numbers.power_lag[wheel]
        self.delay = round(1e9 * numbers.power_delay[wheel])
        self._scale, self._bias = numbers.power_scale[wheel], numbers.power_bias[wheel]
        self.clear()

    def clear(self) -> None:
        """Forget what it followed."""
        self._seen = math.nan

    def follow(self, value: Value, duration: float) -> Value:
        """What it sees of the next step, which lasts `duration` [s]."""
        if self._lag <= 0.0:
            return value
        before = value[0] if math.isnan(self._seen) else self._seen
        self._seen = value[0] + math.exp(-duration / self._lag) * (before - value[0])
        return self._seen, 0.0

    def shown(self, value: float) -> float:
        """What it publishes of what it sees."""
        return self._scale * value + self._bias
