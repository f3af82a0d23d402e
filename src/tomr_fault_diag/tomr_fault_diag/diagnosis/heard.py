"""What came on each input of a recording, and why nothing could be decided where that is so."""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

from attrs import define, field

from tomr_fault_diag.diagnosis.summary import Summary
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.messages.plain import NANOSECONDS

_APART = NANOSECONDS  # stamps of two inputs that have no time in common
_FEW = 5  # commands
_OUT_OF_STEP = 0.1  # s, between commands and encoders, of which diagnoses suffer


@define
class Stream:
    """The messages of one topic."""

    first: Any = None
    last: Any = None
    count: int = 0
    first_ns: int = 0  # receive stamps
    last_ns: int = 0
    silence_ns: int = 0  # longest time without a message
    pauses: int = 0  # times without one in which a command would end

    @property
    def stamps_ns(self) -> tuple[int, int] | None:
        """Header stamps of the first message and the last, None where there is none."""
        first, last = header_stamp_ns(self.first), header_stamp_ns(self.last)
        return (first, last) if first and last else None

    @property
    def late_s(self) -> float | None:
        """How long after its stamp the first message came, or the last one if that is less [s];
        None without stamps."""
        stamps = self.stamps_ns
        if stamps is None:
            return None
        return min(self.first_ns - stamps[0], self.last_ns - stamps[1]) / NANOSECONDS


@define
class Heard:
    """All inputs of a recording, in which commands end after a timeout [ns]; 0: they do not."""

    timeout_ns: int = 0
    streams: dict[str, Stream] = field(factory=dict)

    def note(self, topic: str, message: Any, receive_ns: int) -> None:
        """Count a message."""
        stream = self.streams.get(topic)
        if stream is None:
            stream = Stream(message, first_ns=receive_ns, last_ns=receive_ns)
            self.streams[topic] = stream
        stream.count += 1
        silence = receive_ns - stream.last_ns
        if silence > stream.silence_ns:
            stream.silence_ns = silence
        stream.pauses += 0 < self.timeout_ns < silence
        stream.last_ns = receive_ns
        stream.last = message


def why_undecided(
    heard: Heard, wanted: Iterable[str], complaints: Mapping[tuple[str, str], int], summary: Summary
) -> str:
    """One line on why nothing could be decided: which input was missing or unusable.

    Args:
        heard: what came.
        wanted: topics that the stages read.
        complaints: how often a message of a topic could not be used, and why.
        summary: of the ticks.
    """
    silent = [topic for topic in wanted if topic not in heard.streams and topic != "imu/data"]
    if silent:
        return f"no {', '.join(dict.fromkeys(silent))} in the recording"
    clocks = _backwards(heard) or _apart(heard) or out_of_step(heard)
    if clocks:
        return clocks
    for (topic, problem), count in sorted(complaints.items(), key=lambda item: -item[1]):
        total = heard.streams[topic].count
        if count > total // 2:
            return f"{topic}: {problem} ({count} of {total} messages)"
    if not summary.ticks:
        return "the recording ends before the first decision"
    return summary.missing or "the robot stands still throughout, so no fault could show"


def _backwards(heard: Heard) -> str:
    """Inputs whose stamps fall."""
    spans = [(name, stream.stamps_ns) for name, stream in heard.streams.items()]
    names = [name for name, span in spans if span is not None and span[1] < span[0]]
    return f"the stamps of {', '.join(sorted(names))} run backwards" if names else ""


def out_of_step(heard: Heard) -> str:
    """What to see to where inputs are stamped by clocks that differ; empty where they are not, or
    have no stamps."""
    return _commands_out_of_step(heard) or _power_ahead(heard)


def _power_ahead(heard: Heard) -> str:
    """A power that is stamped long after the encoders: what comes late is stamped before."""
    encoders = heard.streams["joint_states"].late_s if "joint_states" in heard.streams else None
    for name, stream in heard.streams.items():
        late = stream.late_s if name.endswith(("/power", "battery_state")) else None
        if late is not None and encoders is not None and encoders - late > _OUT_OF_STEP:
            return (
                f"{name} is stamped {encoders - late:.2f} s later than joint_states that come at "
                "the same time: synchronise the clocks"
            )
    return ""


def _commands_out_of_step(heard: Heard) -> str:
    """Commands that reach the recording sooner or later after their stamps than the encoders."""
    commands, encoders = (
        heard.streams[name].late_s if name in heard.streams else None
        for name in ("cmd_vel", "joint_states")
    )
    if commands is None or encoders is None or abs(commands - encoders) < _OUT_OF_STEP:
        return ""
    names = ("cmd_vel", "joint_states") if commands > encoders else ("joint_states", "cmd_vel")
    return (
        f"{names[0]} comes {abs(commands - encoders):.2f} s later after its stamps than "
        f"{names[1]}: clocks differ, or messages are held up: synchronise the clocks, or describe "
        "how late commands act as controller.delay (tomr_gap check finds it)"
    )


def rare_commands(heard: Heard) -> str:
    """What to see to where most commands end before the next comes; empty where they do not."""
    commands = heard.streams.get("cmd_vel")
    if commands is None or commands.count < _FEW or 2 * commands.pauses < commands.count:
        return ""
    return (
        "cmd_vel mostly pauses for longer than "
        f"command_timeout = {1e-9 * heard.timeout_ns:g} s, after which a command ends: set "
        "command_timeout: 0 if this robot holds each until the next"
    )


def _apart(heard: Heard) -> str:
    """Two inputs whose stamps have no time in common."""
    spans = [(name, stream.stamps_ns) for name, stream in heard.streams.items()]
    known = [(min(span), max(span), name) for name, span in spans if span is not None]
    if len(known) < 2:
        return ""
    ends, begins = min(known, key=lambda item: item[1]), max(known)
    if begins[0] - ends[1] < _APART:
        return ""
    return (
        f"the stamps of {ends[2]} end at {_date(ends[1])}, those of {begins[2]} begin at "
        f"{_date(begins[0])}: they were stamped by different clocks"
    )


def _date(stamp_ns: int) -> str:
    moment = datetime.fromtimestamp(stamp_ns / NANOSECONDS, tz=UTC)
    return moment.strftime("%Y-%m-%d %H:%M:%S")
