"""Wheels that come in messages of their own, as drivers of single motors send them, joined."""

from collections import deque
from collections.abc import Sequence
from typing import Any

from attrs import frozen

from tomr_power_model.messages.intake import NAN, WheelFinder, Wheels

Reading = tuple[float, ...]  # what is known of a wheel, in the units of its message
_LIVE = 250_000_000  # ns since a wheel was heard, within which it is waited for
_AT_ONCE = 1_000_000  # ns: readings so close need no interpolation
_UNKNOWN = (NAN, NAN, NAN)


@frozen
class Sample:
    """Readings of the wheels at one time, None of those that are not there."""

    stamp_ns: int
    wheels: tuple[Reading | None, ...]


class Joined:
    """Makes samples of all wheels that are heard out of messages with some of them.

    A message that has them all goes on as it is. Else a sample is made at each stamp of the first
    wheel, once the others are known until then: between two readings of a wheel linearly.
    """

    def __init__(self, wheels: int) -> None:
        """So many wheels, of which none has been heard."""
        self._readings: list[deque[tuple[int, Reading]]] = [deque() for _ in range(wheels)]
        self._done = 0  # stamp of the newest sample [ns]

    @property
    def is_idle(self) -> bool:
        """Whether no wheel has come without the others lately."""
        return not self._done

    def add(self, message: Sample) -> Sequence[Sample]:
        """Take a message of one stream; returns the samples that are complete now, in order."""
        stamp, present = message.stamp_ns, [item is not None for item in message.wheels]
        if all(present) or stamp <= 0:
            if self._done:
                self._clear()
            return (message,)
        newest = max((queue[-1][0] for queue in self._readings if queue), default=stamp)
        if stamp < newest - _LIVE:  # time went back
            self._clear()
        for queue, reading in zip(self._readings, message.wheels, strict=True):
            if reading is not None and (not queue or stamp > queue[-1][0]):
                queue.append((stamp, reading))
            # One reading before the next sample is enough, and none of a wheel that is silent.
            while len(queue) > 1 and queue[1][0] <= self._done:
                queue.popleft()
        live = [bool(queue) and stamp - queue[-1][0] < _LIVE for queue in self._readings]
        if live == present:  # nothing to be joined, and repeats are judged by others
            self._done = stamp
            return (message,)
        return self._complete(live)

    def _clear(self) -> None:
        for queue in self._readings:
            queue.clear()
        self._done = 0

    def _complete(self, live: Sequence[bool]) -> list[Sample]:
        """The samples that can be made of the wheels that are live."""
        heard = [queue for queue, is_live in zip(self._readings, live, strict=True) if is_live]
        known = min(queue[-1][0] for queue in heard) + _AT_ONCE
        found = []
        for stamp, _ in heard[0]:
            if self._done < stamp <= known and all(
                queue[0][0] <= stamp + _AT_ONCE for queue in heard
            ):
                wheels = [
                    _at(stamp, queue) if is_live else None
                    for queue, is_live in zip(self._readings, live, strict=True)
                ]
                found.append(Sample(stamp, tuple(wheels)))
        if found:
            self._done = found[-1].stamp_ns
        return found


class WheelStream:
    """The wheels of one stream of JointState, whose messages may have some of them, or none."""

    def __init__(self, wheel_names: tuple[str, str, str]) -> None:
        self._names = wheel_names
        self._finder = WheelFinder(wheel_names)
        self._joined = Joined(len(wheel_names))
        self._last: Any = None
        self._samples: Sequence[tuple[int, Wheels]] = ()
        self.newest = 0  # stamp of the last message of wheels [ns], 0 where that had not all

    def samples(self, message: Any, stamp_ns: int) -> Sequence[tuple[int, Wheels]]:
        """Samples that a message completes, with their stamps [ns], in order; none where it is of
        other joints alone. Raises Unusable as `WheelFinder.read`."""
        if message is not self._last:  # two stages read the same
            is_others = self._finder.is_others(message)
            if not is_others:  # what cannot be read counts as well: a flood of it is left out
                self.newest = stamp_ns
            is_quiet = is_others and self._finder.is_heard
            self._samples = () if is_quiet else self._completed(message, stamp_ns)
            self._last = message
        return self._samples

    def _completed(self, message: Any, stamp_ns: int) -> Sequence[tuple[int, Wheels]]:
        found = self._finder.read(message)
        self.newest = 0 if found.absent else stamp_ns
        if not found.absent and self._joined.is_idle:
            return ((stamp_ns, found),)
        rows = zip(self._names, found.position, found.velocity, found.effort, strict=True)
        readings = tuple(None if name in found.absent else tuple(row) for name, *row in rows)
        complete = self._joined.add(Sample(stamp_ns, readings))
        return [(sample.stamp_ns, self._wheels(sample)) for sample in complete]

    def _wheels(self, sample: Sample) -> Wheels:
        position, velocity, effort = zip(*(row or _UNKNOWN for row in sample.wheels), strict=True)
        rows = zip(self._names, sample.wheels, strict=True)
        return Wheels(position, velocity, effort, tuple(name for name, row in rows if row is None))


def _at(stamp_ns: int, queue: Sequence[tuple[int, Reading]]) -> Reading:
    """A wheel's reading at a time: the nearest one, or between two."""
    nearest, reading = min(queue, key=lambda item: abs(item[0] - stamp_ns))
    if abs(nearest - stamp_ns) <= _AT_ONCE:
        return reading
    after = next(number for number, item in enumerate(queue) if item[0] > stamp_ns)
    (start, first), (end, last) = queue[after - 1], queue[after]
    share = (stamp_ns - start) / (end - start)
    return tuple(a + share * (b - a) for a, b in zip(first, last, strict=True))
