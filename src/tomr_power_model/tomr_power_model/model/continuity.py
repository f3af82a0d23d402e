"""Where the samples of a stream do not join up: nothing is concluded from the time around it.

Silences are held against what is usual on this stream: three times its median interval, within
bounds for all streams of a kind. Stamps that precede what was read already, message after message,
are a clock that was put back, which leaves a gap as well. Judged at a tick from the stamps up to
it, so that the answer does not depend on when messages arrive.
"""

from collections import deque
from statistics import median

from attrs import frozen

from tomr_power_model.errors import one_line
from tomr_power_model.model.ticks import Arrival, to_ns

_USUAL = 3.0  # intervals: a longer silence is a gap
_KEPT = 31  # intervals to take the usual one from
_FEWEST = 5
_EVERY = 8  # samples: how often it is taken anew, after the first time
_RARE = 3  # gaps in a row: samples do not come more often
_ENDED = 3  # times the last gap: what comes rarely does no more
_STRAYS = 3  # messages in a row that precede: fewer are late ones
_RATED = to_ns(2.0)  # time over which a rate is counted


@frozen
class Tolerance:
    """Silences of a kind of stream, in nanoseconds."""

    shortest: int  # no shorter one is a gap
    longest: int  # every longer one is
    after: int  # time after a gap from which nothing is concluded either
    share: float = 0.0  # of the gap's length, on top of that


# Contract: encoders at 50 Hz or more, power at 10, commands at 5.
ENCODER_TOLERANCE = Tolerance(to_ns(0.05), to_ns(0.15), to_ns(0.25))
POWER_TOLERANCE = Tolerance(to_ns(0.1), to_ns(0.35), to_ns(0.05))
# What a robot did in a gap, its simulation does after it, and takes as long as that.
COMMAND_TOLERANCE = Tolerance(to_ns(0.125), to_ns(0.5), to_ns(0.3), share=1.0)
_LONGEST = to_ns(0.6)  # of a gap, as far as `share` goes
# In place of how far a message went back.
_REFUSED = -1
_MISPLACED = -2
_REPEATED = -3
_FOREIGN = -4


class Continuity:
    """Follows the stamps of one stream."""

    def __init__(self, tolerance: Tolerance) -> None:
        self._tolerance = tolerance
        self.clear()

    def clear(self) -> None:
        """Forget the stream."""
        self._was_read = False
        self._ahead: deque[tuple[int, int]] = deque()  # stamp, and how far a message went back
        self._read = 0  # newest stamp that came
        self._last = 0  # newest one up to the last tick
        self._intervals: deque[int] = deque(maxlen=_KEPT)
        self._counted: deque[int] = deque()
        self._in_order: deque[bool] = deque(maxlen=_KEPT)
        self._count = 0
        self._tolerated = self._tolerance.longest
        self._back, self._strays, self._misplaced = 0, 0, 0
        self._excused = 0
        self._foreign = 0  # how far the newest message of another clock is ahead [ns]
        self.ahead = 0  # the same, up to the last tick; 0 once a sample came
        self.refused = 0  # messages up to the last tick
        self.refused_at = 0  # newest stamp before the last of them, 0: there was none
        self.refused_since = 0  # the newest sample
        self.reason = ""  # why the last one was refused
        self._reasons: deque[str] = deque()
        self.gaps = 0
        self.resumed = 0  # first stamp after the last gap, 0: there was none
        self.silence = 0  # how long that was [ns]
        self._until = 0
        self._pauses = 0  # gaps without a usual interval in between

    def leap(self) -> None:
        """Forget the stream where its stamps leap, but for having been heard."""
        was_read = self._was_read or self._read > 0
        self.clear()
        self._was_read = was_read

    def take(self, stamp_ns: int) -> None:
        """Take the stamp of a sample, newer than those before."""
        self._read = stamp_ns
        self._ahead.append((stamp_ns, 0))

    def precedes(self, stamp_ns: int) -> None:
        """Take note of an ignored message: it repeats an earlier stamp or precedes one, or has
        none."""
        if self._read > stamp_ns > 0:
            self._ahead.append((self._read, self._read - stamp_ns))
        else:
            self._ahead.append((self._read, _REPEATED if stamp_ns > 0 else _MISPLACED))

    def misplace(self) -> None:
        """Take note of a message whose stamp is none, repeated, or too old to be of use."""
        self._ahead.append((self._read, _MISPLACED))

    def ignore(self, arrival: Arrival, stamp_ns: int, ahead_ns: int) -> None:
        """Take note of an ignored message; one of another clock is so far ahead of the others."""
        if arrival is Arrival.FOREIGN:
            self._foreign = ahead_ns
            self._ahead.append((self._read, _FOREIGN))
        else:
            self.precedes(stamp_ns)

    def refuse(self, reason: str) -> None:
        """Take note of a message that cannot be used, and why."""
        self._reasons.append(one_line(reason))
        self._ahead.append((self._read, _REFUSED))

    def restart(self, stamp_ns: int) -> None:
        """What comes from a stamp on has nothing to do with what came before."""
        self._ahead.extend([(stamp_ns, 1)] * _STRAYS)

    def excuse(self, tick_ns: int) -> None:
        """The present silence is no gap: nothing can have happened in it up to this tick."""
        self._excused = tick_ns

    def last(self, tick_ns: int) -> int:
        """Newest stamp up to a tick, 0 before the first."""
        while self._ahead and self._ahead[0][0] <= tick_ns:
            self._follow(*self._ahead.popleft())
        return self._last

    def is_broken(self, tick_ns: int) -> bool:
        """Whether at a tick the stream pauses, went on only just before, is in no order, or has
        too few samples for any of them to be held against a tick."""
        pauses = self.is_silent(tick_ns) or tick_ns < self._until
        return pauses or self.is_rare(tick_ns) or self._is_disordered()

    def is_rare(self, tick_ns: int) -> bool:
        """Whether samples come one by one, with gaps between them, and have not ended."""
        age = tick_ns - self.last(tick_ns)
        return self._pauses >= _RARE and age < _ENDED * self.silence

    def _is_disordered(self) -> bool:
        """Whether hardly any of the last messages could be placed; repeats do not count, as some
        robots send each message twice."""
        return 3 * sum(self._in_order) < len(self._in_order)

    def is_silent(self, tick_ns: int) -> bool:
        """Whether at a tick nothing has come for longer than usual."""
        last = self.last(tick_ns)
        return bool(last) and tick_ns - last > self._tolerated

    def is_misplaced(self, tick_ns: int) -> bool:
        """Whether nothing is known at a tick because of stamps: the sensor itself may be well."""
        last = self.last(tick_ns)
        return self._misplaced >= _STRAYS or (not last and self._was_read)

    def rate(self, tick_ns: int) -> float:
        """Samples per second of the last moments [Hz]."""
        self.last(tick_ns)
        recent = [stamp for stamp in self._counted if stamp > tick_ns - _RATED]
        return 1e9 * (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 1 else 0.0

    def _follow(self, stamp: int, back: int) -> None:
        if back:
            self._ignore(stamp, back)
            return
        silence = stamp - self._last if self._last else 0
        if not self._last and self._was_read:
            self._break_off(stamp, _LONGEST)  # the stamps leapt: who knows how long it was
        elif self._strays >= _STRAYS:
            silence = max(silence, self._back)
            self._break_off(stamp, silence)
        elif silence > self._tolerated:
            if stamp - self._excused > self._tolerated:
                self._break_off(stamp, silence)
                self._pauses += 1
        elif silence:
            self._intervals.append(silence)
            self._pauses = 0
        self._back, self._strays, self._misplaced, self._last = 0, 0, 0, stamp
        self.ahead = 0
        self.refused_since = 0
        self._count += 1
        self._in_order.append(True)
        self._counted.append(stamp)
        while self._counted[0] <= stamp - _RATED:
            self._counted.popleft()
        known = len(self._intervals)
        if known == _FEWEST or (known > _FEWEST and self._count % _EVERY == 0):
            given = self._tolerance
            usual = round(_USUAL * median(self._intervals))
            self._tolerated = min(max(usual, given.shortest), given.longest)

    def _ignore(self, stamp: int, back: int) -> None:
        """Count a message that is none of the samples."""
        if back == _REFUSED:
            self.reason = self._reasons.popleft()
        else:
            self._misplaced += 1
        if back not in (_REFUSED, _REPEATED):
            self._in_order.append(False)
        if back == _FOREIGN:
            self.ahead = self._foreign
        if back not in (_MISPLACED, _REPEATED, _FOREIGN):
            self.refused, self.refused_at = self.refused + 1, stamp
            self.refused_since += 1
        if back > 0:
            self._back, self._strays = max(self._back, back), self._strays + 1

    def _break_off(self, stamp: int, silence: int) -> None:
        given = self._tolerance
        self.resumed, self.silence, self.gaps = stamp, silence, self.gaps + 1
        self._until = stamp + given.after + round(given.share * min(silence, _LONGEST))
