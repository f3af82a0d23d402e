"""When to decide: a grid of data stamps, reached when all live streams have passed it.

A stage's answer for the tick t_k uses messages with stamps up to t_k and nothing else, so it does
not depend on the order in which topics happen to arrive. It is given as soon as

- every live periodic stream has a stamp at or past t_k, and some stream is `settle` past it,
  which leaves sparse streams (commands) that long to arrive; or
- some stream is `patience` past it: a stream that silent is not live and not waited for.

Commands that are always ahead of the periodic streams, by another clock, count by so much less.

A stream whose stamps leap begins anew, and all with it. One that is far from the others without
having leapt is of another clock and left out, unless more sensors are of its clock than of theirs.
"""

import math
from collections import deque
from collections.abc import Collection, Sequence
from enum import Enum
from typing import TypeVar

from attrs import frozen

NANOSECONDS = 1_000_000_000
NEVER = -3600 * NANOSECONDS  # before any stamp: a simulated clock begins at 0
_SLOWLY = 50  # samples over which a larger lead of the commands is believed


def to_ns(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(seconds * NANOSECONDS)


@frozen
class TickSettings:
    """Timing of a stage, in nanoseconds of data time."""

    period: int = to_ns(0.05)
    settle: int = to_ns(0.02)
    patience: int = to_ns(0.25)
    gap: int = to_ns(1.0)  # a longer silence or jump starts afresh; at least 2 * patience counts
    phase: int = 0  # by which the grid is shifted


Sample = TypeVar("Sample", bound=tuple[int, *tuple[float, ...]])  # stamp [ns] and values


def of_tick(samples: deque[Sample], tick: int, period: int, stale: int) -> list[Sample]:
    """The samples that a tick compares: those stamped in (tick - period, tick].

    Nothing is filled in: a window without a sample takes the newest one that is not stale. Forgets
    what no later tick asks for.
    """
    while len(samples) > 1 and samples[1][0] <= tick - period:
        samples.popleft()
    inside = [sample for sample in samples if tick - period < sample[0] <= tick]
    return inside or [sample for sample in samples if tick - stale < sample[0] <= tick][-1:]


class Arrival(Enum):
    """What became of a message's stamp."""

    TAKEN = "taken"
    UNSTAMPED = "has no stamp"
    REPEATED = "repeats or precedes an earlier stamp"
    RESTARTED = "jumps"
    FOREIGN = "is of another clock than the other topics'"


class TickClock:
    """Follows the stamps of several streams and says which ticks are due."""

    def __init__(self, settings: TickSettings, expected: Collection[str] = ()) -> None:
        """`expected` streams are waited for up to `patience` even before their first message."""
        self.settings = settings
        self._expected = expected
        # What is waited for is late and no jump, and so is what waited in the stage before.
        self._gap = max(settings.gap, 2 * settings.patience)
        self._settle = settings.settle
        self._newest: dict[str, int] = {}
        self._periodic: set[str] = set()
        # The same of streams that were left out, or heard before time leapt.
        self._elsewhere: dict[str, int] = {}
        self._sensors: set[str] = set()  # the periodic ones, once another was far from them
        self._watermark = 0
        self._lead = 0
        self._resumed = 0  # stamp at which all streams went on after a silence
        self._next = 0  # stamp of the next tick, 0: not started

    def arrive(self, stream: str, stamp_ns: int, periodic: bool = True) -> Arrival:
        """Take note of a message. After RESTARTED the caller forgets what it has gathered."""
        if stamp_ns <= 0:
            return Arrival.UNSTAMPED
        if not self._next:
            self._start(stream, stamp_ns, periodic)
            return Arrival.TAKEN
        ahead = stamp_ns - self._watermark
        if abs(ahead) > self._gap:
            return self._far(stream, stamp_ns, periodic)
        if stamp_ns <= self._newest.get(stream, 0):
            return Arrival.REPEATED
        self._newest[stream] = stamp_ns
        if periodic:
            self._periodic.add(stream)
            self._measure_lead()
        else:
            ahead -= self._lead
        if ahead > self.settings.period:
            self._resumed = stamp_ns
        if ahead > 0:
            self._watermark += ahead
        return Arrival.TAKEN

    @property
    def sensors(self) -> int:
        """Newest stamp of a periodic stream [ns], 0 before the first."""
        return max((self._newest[name] for name in self._periodic), default=0)

    def off(self, stream: str) -> int:
        """How far a FOREIGN stream is ahead of the others [ns]."""
        return self._elsewhere.get(stream, self._watermark) - self._watermark

    def _far(self, stream: str, stamp_ns: int, periodic: bool) -> Arrival:
        """Whether a stamp far from the others' means that time leapt, or only another clock."""
        before = self._newest.pop(stream, None)
        # A command that was held up is between the last one and what sensors have come to.
        leaps = before is not None and (
            stamp_ns < before - self._gap or stamp_ns > max(before + self._gap, self._watermark)
        )
        self._elsewhere[stream] = stamp_ns
        self._sensors |= self._periodic | ({stream} if periodic else set())
        self._periodic.discard(stream)
        if not leaps and self._sensors_about(stamp_ns) <= self._sensors_about(self._watermark):
            return Arrival.FOREIGN
        self._start(stream, stamp_ns, periodic)
        return Arrival.RESTARTED

    def _sensors_about(self, stamp_ns: int) -> int:
        """How many sensors were not far from a stamp when they were heard last."""
        newest = self._elsewhere | self._newest
        return sum(abs(newest[name] - stamp_ns) <= self._gap for name in self._sensors)

    def _measure_lead(self) -> None:
        """How far the others are ahead of the periodic streams: commands whose clock is ahead, or
        that come sooner, say nothing of the time that has passed. Less counts at once."""
        latest = max(self._newest[name] for name in self._periodic)
        others = [stamp for name, stamp in self._newest.items() if name not in self._periodic]
        lead = max(0, max(others, default=latest) - latest)
        self._lead = min(lead, self._lead + (lead - self._lead) // _SLOWLY)

    def _start(self, stream: str, stamp_ns: int, periodic: bool) -> None:
        self._elsewhere |= self._newest
        self._newest = {stream: stamp_ns}
        self._periodic = {stream} if periodic else set()
        self._watermark = self._resumed = stamp_ns
        self._lead = 0  # ns
        period, phase = self.settings.period, self.settings.phase
        self._next = ((stamp_ns - phase) // period + 1) * period + phase

    def due(self) -> Sequence[int]:
        """Stamps of the ticks that can be decided now, in order."""
        # Asked after every message, and mostly nothing is due.
        if self._watermark < self._next + self._settle or not self._next:
            return ()
        ticks = []
        while self._watermark >= self._next + self.settings.settle:
            tick = self._next
            # After a silence of all streams the others deserve as much time to go on as the first.
            patient_until = max(tick, self._resumed) + self.settings.patience
            if self._slowest_live() < tick and self._watermark < patient_until:
                break
            self._next = tick + self.settings.period
            ticks.append(tick)
        return ticks

    def _slowest_live(self) -> float:
        """The newest stamp of the live periodic stream that lags most."""
        oldest_live = self._watermark - self.settings.patience
        live = [self._newest[name] for name in self._periodic if self._newest[name] >= oldest_live]
        awaited = [self._newest.get(name, 0) for name in self._expected]
        return min((*live, *awaited), default=math.inf)
