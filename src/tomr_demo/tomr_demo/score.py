"""What was true, what was named, and whether it was named in time. No ROS, no clock: stamps only.

The live table and the figure drawn from a recording score with the same code.
"""

from itertools import pairwise
from typing import Any

from attrs import define, field, frozen

from tomr_fault_diag.classifier.states import (
    CONTROL,
    MOTOR,
    NORMAL,
    NOT_ENOUGH,
    NOT_OBSERVABLE,
    SLIP,
    STALE,
    STATES,
    UNKNOWN,
    WAITING,
)
from tomr_power_model.messages.plain import NANOSECONDS

TIME_TO_NAME = NANOSECONDS  # in which a fault has to be named
TIME_TO_RECOVER = 3 * NANOSECONDS  # in which normal has to be named again

DIAGNOSTICS = "/diagnostics"
TRUTH = "/ground_truth/faults"
HEALTHY = "healthy"
NORMAL_STATE = STATES[NORMAL].name
_UNDECIDED = (NOT_OBSERVABLE.name, NOT_ENOUGH.name)
_NO_FAULTS = (NORMAL_STATE, WAITING.name, STALE.name)


@frozen
class Named:
    """What /diagnostics said at a stamp [ns]."""

    stamp_ns: int
    state: str
    probability: float | None = None  # of that state
    evidence: tuple[str, ...] = ()
    since_ns: int = 0  # from when on the state holds


def truth_in(message: Any) -> tuple[str | None, int]:
    """Read id and wheel (1..3) of the fault in force out of ground_truth/faults."""
    fault_id, wheel = None, 1
    for status in message.status:
        values = {item.key: float(item.value) for item in status.values}
        if values.get("active", 0.0) > 0.0:
            fault_id, wheel = status.name, int(values.get("wheel", 1.0))
    return fault_id, wheel


def named_in(message: Any, stamp_ns: int) -> Named | None:
    """Read the classifier's status out of a message of /diagnostics, None if it is another's."""
    for status in message.status:
        values = {item.key: str(item.value) for item in status.values}
        if "state" in values:
            # Where nothing can be seen nothing is said to be wrong: as good as normal here.
            state = NORMAL_STATE if values["state"] in _UNDECIDED else values["state"]
            share = values.get(f"p {state}")
            evidence = tuple(text for key, text in values.items() if key.startswith("evidence "))
            return Named(
                stamp_ns,
                state,
                None if share is None else float(share),
                evidence,
                _stamp_of(values.get("since", ""), stamp_ns),
            )
    return None


def _stamp_of(text: str, otherwise: int) -> int:
    """A time such as "12.000000500" [s], exactly, as a stamp [ns]."""
    seconds, point, rest = text.partition(".")
    if not (seconds.isdecimal() and point and rest.isdecimal() and len(rest) == 9):
        return otherwise
    return int(seconds) * NANOSECONDS + int(rest)


@define
class Stretch:
    """A time in which the same thing was true, and what was named meanwhile.

    It starts at the last stamp at which something else was stated to be true: early by up to the
    period of the truth, so that no delay is flattered.
    """

    fault_id: str | None
    wheel: int | None  # number 1..3, of the faults that sit on one
    start_ns: int
    before: Named | None = None  # the diagnosis that stood at the start
    end_ns: int | None = None
    named: list[Named] = field(factory=list)

    @property
    def title(self) -> str:
        """What was true, in words."""
        titles = {
            None: HEALTHY,
            "floor_slippery": "floor slippery",
            "control_signal_lost": f"wheel {self.wheel}: signal lost",
            "encoder_lost": f"wheel {self.wheel}: encoder lost",
        }
        return titles.get(self.fault_id, str(self.fault_id))

    @property
    def expected(self) -> str:
        """Name of the state that is to be named."""
        states = {
            None: NORMAL,
            "floor_slippery": SLIP,
            "control_signal_lost": CONTROL,
            "encoder_lost": MOTOR + (self.wheel or 1) - 1,
        }
        index = states.get(self.fault_id)
        return UNKNOWN.name if index is None else STATES[index].name

    @property
    def right(self) -> Named | None:
        """The message that first named it; a fault left over from before does not count."""
        stands = self.before is not None and self.before.state == self.expected
        if stands and self.fault_id is None:
            return self.before
        for named in self.named:
            stands = stands and named.state == self.expected
            if named.state == self.expected and not stands:
                return named
        return None

    @property
    def delay_ns(self) -> int | None:
        """From the start to the naming, None while it has not been named."""
        return None if self.right is None else max(0, self.right.stamp_ns - self.start_ns)

    @property
    def strays(self) -> tuple[str, ...]:
        """Faults that were named and not there, in order of appearance.

        After a fault has gone they count from when normal was named: until then the robot, which
        may have been thrown about, settles.
        """
        right = self.right
        since = self.start_ns
        if self.fault_id is None and right is not None:
            since = right.stamp_ns
        allowed = (self.expected, *_NO_FAULTS)
        names = [named.state for named in self.named if named.stamp_ns > since]
        return tuple(dict.fromkeys(name for name in names if name not in allowed))

    def held(self, now_ns: int) -> float:
        """Share of the time since the naming, up to the end or now, in which the name stood."""
        right = self.right
        if right is None:
            return 0.0
        since = max(right.stamp_ns, self.start_ns)
        end = max(now_ns if self.end_ns is None else self.end_ns, since + 1)
        marks = [(since, True)]
        marks += [(n.stamp_ns, n.state == self.expected) for n in self.named if n.stamp_ns > since]
        marks.append((end, True))
        return sum(until - at for (at, stands), (until, _) in pairwise(marks) if stands) / (
            end - since
        )

    def passed(self, now_ns: int) -> bool | None:
        """Whether it was named in time and, if healthy, no fault was invented; None: still open."""
        limit = TIME_TO_RECOVER if self.fault_id is None else TIME_TO_NAME
        delay = self.delay_ns
        if delay is None:
            over = self.end_ns is not None or now_ns - self.start_ns > limit
            return False if over else None
        if delay > limit or (self.fault_id is None and self.strays):
            return False
        return True if self.fault_id or self.end_ns is not None else None


@define
class Scoreboard:
    """Cuts the truth into stretches and puts each diagnosis where its stamp belongs."""

    stretches: list[Stretch] = field(factory=list)
    latest: Named | None = None
    now_ns: int = 0
    _heard_ns: int = 0  # newest stamp of the truth

    @property
    def passed(self) -> bool:
        """Whether there was a fault and every stretch is as it should be."""
        verdicts = [stretch.passed(self.now_ns) for stretch in self.stretches]
        has_fault = any(stretch.fault_id for stretch in self.stretches)
        return has_fault and all(verdict is True for verdict in verdicts)

    @property
    def named(self) -> list[Named]:
        """All that was named, in order, from before the first stretch on."""
        first = self.stretches[0].before if self.stretches else self.latest
        return [*([first] if first else []), *(n for s in self.stretches for n in s.named)]

    def take(self, topic: str, message: Any, stamp_ns: int) -> None:
        """Take a message of /diagnostics or ground_truth/faults; others do not matter."""
        if topic == TRUTH:
            self.truth(stamp_ns, *truth_in(message))
        elif topic == DIAGNOSTICS:
            named = named_in(message, stamp_ns)
            if named is not None:
                self.diagnosis(named)

    def truth(self, stamp_ns: int, fault_id: str | None, wheel: int) -> None:
        """Note what is true: a fault's id, None while all is well, and its wheel (1..3)."""
        current = self.stretches[-1] if self.stretches else None
        place = None if fault_id in (None, "floor_slippery") else wheel
        if current is None or (current.fault_id, current.wheel) != (fault_id, place):
            self._open(Stretch(fault_id, place, self._heard_ns or stamp_ns), current)
        self._heard_ns = stamp_ns
        self.now_ns = max(self.now_ns, stamp_ns)

    def diagnosis(self, named: Named) -> None:
        """Note what was named; it may come after the truth of a later stamp."""
        self.latest = named
        self.now_ns = max(self.now_ns, named.stamp_ns)
        for stretch in reversed(self.stretches):
            if named.stamp_ns > stretch.start_ns:
                stretch.named.append(named)
                return
            stretch.before = named

    def close(self) -> None:
        """End the last stretch now."""
        if self.stretches:
            self.stretches[-1].end_ns = self.now_ns

    def _open(self, stretch: Stretch, current: Stretch | None) -> None:
        stretch.before = self.latest
        if current is not None:
            current.end_ns = stretch.start_ns
            stretch.named = [n for n in current.named if n.stamp_ns > stretch.start_ns]
            current.named = [n for n in current.named if n.stamp_ns <= stretch.start_ns]
            stretch.before = current.named[-1] if current.named else current.before
        self.stretches.append(stretch)
