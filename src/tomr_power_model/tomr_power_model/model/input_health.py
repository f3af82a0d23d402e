"""How each input of a stage does, beside what the diagnosis makes of it: rate, age, quality."""

from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Level, Status
from tomr_power_model.model.continuity import Continuity
from tomr_power_model.model.ticks import to_ns

TOPIC = "/diagnostics"
_MANY = 3  # messages in a row that cannot be used
_PAUSE = to_ns(0.5)  # of the commands: who is silent for so long has ended, and begun anew
_YEARS = to_ns(1e8)  # between the clocks of a computer and of a simulation
_RECENT = to_ns(2.0)  # in which a gap or a refused message is worth a warning


def apart(ahead_ns: int) -> str:
    """What to say of a stream whose stamps are so far ahead of those of the others [ns]."""
    way = "ahead of" if ahead_ns > 0 else "behind"
    is_simulated = abs(ahead_ns) > _YEARS
    remedy = "set use_sim_time everywhere" if is_simulated else "synchronise the clocks"
    return f"stamped {1e-9 * abs(ahead_ns):.1f} s {way} the other inputs: {remedy}"


@frozen
class InputState:
    """What is to be said of one stream."""

    topic: str
    flow: Continuity
    ailment: str = ""  # what else is wrong with what comes
    is_optional: bool = False  # commands may end, or not have begun

    def verdict(self, tick_ns: int) -> tuple[Level, str]:
        """How it does at a tick."""
        flow, last = self.flow, self.flow.last(tick_ns)
        age = tick_ns - last
        if flow.is_misplaced(tick_ns):
            return Level.WARN, apart(flow.ahead) if flow.ahead else "its stamps do not fit"
        if flow.refused_since >= _MANY:
            return Level.WARN, f"sends what cannot be used: {flow.reason}"
        if flow.is_rare(tick_ns):
            return Level.WARN, f"comes every {1e-9 * flow.silence:.1f} s: too rarely to be compared"
        if not last:
            return (Level.OK, "waiting") if self.is_optional else (Level.STALE, "no message yet")
        # What is always late seems to be silent for as long.
        if flow.is_silent(tick_ns) and (age > _PAUSE or not self.ailment):
            level = Level.OK if self.is_optional else Level.WARN
            return level, f"silent for {1e-9 * age:.1f} s"
        if self.ailment:
            return Level.WARN, self.ailment
        if flow.refused_at and tick_ns - flow.refused_at < _RECENT:
            return Level.WARN, f"sends what cannot be used at times: {flow.reason}"
        paused = self.is_optional and flow.silence >= _PAUSE
        if flow.resumed and tick_ns - flow.resumed < _RECENT and not paused:
            return Level.WARN, "a gap a moment ago"
        return Level.OK, "as it should be"

    def status(self, tick_ns: int, hardware_id: str) -> Status:
        """As a status, with a name that stays."""
        level, words = self.verdict(tick_ns)
        last = self.flow.last(tick_ns)
        age = f"{1e-9 * (tick_ns - last):.3f}" if last else ""
        values = (
            ("rate", f"{self.flow.rate(tick_ns):.1f}"),
            ("age", age),
            ("gaps", str(self.flow.gaps)),
            ("refused", str(self.flow.refused)),
        )
        return Status(f"inputs: {self.topic}", level, words, values, hardware_id)


@frozen
class Remark:
    """What is to be said of an input that is no stream, such as a file."""

    topic: str
    level: Level
    message: str

    def verdict(self, tick_ns: int) -> tuple[Level, str]:
        """How it does."""
        return self.level, self.message

    def status(self, tick_ns: int, hardware_id: str) -> Status:
        """As a status, with a name that stays."""
        name = f"inputs: {self.topic}"
        return Status(name, self.level, self.message, hardware_id=hardware_id)


def terms_remark(outside: Sequence[str]) -> Remark:
    """Whether the motion is one that learnt terms were learnt in; `outside`: families of those
    that are beyond their tables."""
    if not outside:
        return Remark("learnt terms", Level.OK, "within their tables")
    words = f"fading beyond the table of {', '.join(outside)}"
    return Remark("learnt terms", Level.WARN, words)


class InputReporter:
    """Says how inputs do: once in a while, and at once when one gets better or worse."""

    def __init__(self, period_ns: int = to_ns(1.0)) -> None:
        self._period = period_ns
        self._levels: list[Level] = []
        self._slot = 0
        self._reports: list[DiagnosticMessage] = []

    def take(self, tick_ns: int, states: Sequence[InputState | Remark], hardware_id: str) -> None:
        """Look at all inputs of a stage at a tick."""
        levels = [state.verdict(tick_ns)[0] for state in states]
        slot = tick_ns // self._period
        if levels == self._levels and slot == self._slot:
            return
        self._levels, self._slot = levels, slot
        statuses = tuple(state.status(tick_ns, hardware_id) for state in states)
        self._reports.append(DiagnosticMessage(TOPIC, tick_ns, statuses))

    def due(self) -> list[DiagnosticMessage]:
        """What is to be published, in order."""
        reports, self._reports = self._reports, []
        return reports
