"""The course of a soak: what happens is brought about, and how soon the verdict is back noted."""

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from processes import command_path

from soak.acts import (
    ENCODERS,
    HEALTHY,
    POWER,
    SIMULATOR,
    STREAMS,
    SUITES,
    Act,
    Condition,
    Flood,
    Interruption,
    Jump,
    Kill,
    Pause,
    acts,
)
from soak.crew import Crew
from soak.judge import HEARS_WITHIN, Delays, Item, memory_items, table
from soak.relay_node import PLANT, Relay
from tomr_fault_diag.classifier.states import DISOBEYS, FAULTLESS, POWER_SENSOR, UNKNOWN
from tomr_power_model.errors import InputError
from tomr_power_model.files import write_text
from tomr_power_model.messages.plain import NANOSECONDS

FLOODER = "flooder"
_FLOOD = Path(__file__).with_name("flood_node.py")
_START = 1_700_000_000  # s, stamp of the first message
_STUCK_S = 120.0  # of this computer: the longest wait
_GIVEN_UP = 8.0  # s after which a verdict is waited for no more
_QUIET = 1.5  # s of undisturbed driving after a verdict
_WARM_UP, _WARM_UP_SHARE = 120.0, 0.2  # s, of the whole


class Soak:
    """One run."""

    def __init__(self, robot: Path, out: Path, speed: float, seconds: float) -> None:
        """`seconds` of the robot, at `speed` times real time."""
        self._robot, self._speed, self._seconds = robot, speed, seconds
        self._crew = Crew(self._command, out)
        self._delays = Delays()
        self._hearing = Delays("messages after", HEARS_WITHIN)
        self._false: Counter[str] = Counter()
        self._verdicts: dict[str, tuple[str, int]] = {}  # suite: usable state, heard at [ns]
        self._heard = 0
        self._condition = HEALTHY
        self._allowed: set[str] = set()
        self._last: dict[str, str] = {}
        self._doing = "start"
        self._kills = 0
        self._flooded = ""
        self._begun = time.monotonic()
        self._relay: Relay
        self._course: TextIO

    def run(self, seed: int, flood: float) -> list[Item]:
        """Run to the end; what was found."""
        broken = ""
        with self._running():
            try:
                self._play(acts(seed, flood))
            except InputError as error:
                broken = str(error)
            ended = self._crew.end()
        whole = Item("the soak went to its end", broken or "yes", not broken)
        return [*self._found(), *ended, whole]

    def _play(self, course: Iterable[Act]) -> None:
        self._await_nodes()
        end = self._relay.now_ns + round(self._seconds * NANOSECONDS)
        self._half = self._relay.now_ns // 2 + end // 2
        self._await_verdict("start")
        for act in course:
            self._become(act.condition)
            for interruption in act.interruptions:
                self._interrupt(interruption)
            write_text(self._crew.logs / "so_far.md", table(self._found()) + "\n")
            if self._relay.now_ns > end:
                break

    def _found(self) -> list[Item]:
        warm_up = min(_WARM_UP, _WARM_UP_SHARE * self._seconds / self._speed)
        false = ", ".join(f"{count} {words}" for words, count in self._false.most_common())
        driven = (self._relay.now_ns / NANOSECONDS - _START) / 60.0
        passed = (time.monotonic() - self._begun) / 60.0
        return [
            Item("driven", f"{driven:.1f} min of the robot in {passed:.1f} min", True),
            *self._delays.items(),
            *self._hearing.items(),
            Item("false words", false or f"none in {self._heard} messages", not false),
            *memory_items(self._crew.lives, warm_up),
        ]

    def _command(self, name: str) -> list[str]:
        if name == FLOODER:
            topics = [f"{space}/{ENCODERS}" for space in (PLANT, self._flooded)]
            return [sys.executable, str(_FLOOD), *topics, str(self._relay.shift_ns)]
        ros = ["--ros-args", "--params-file", str(self._robot)]
        if name == SIMULATOR:
            start = self._relay.now_ns / NANOSECONDS + 1.0 if self._relay.now_ns else _START
            given = [f"start_time:={start:.3f}", f"real_time_factor:={self._speed}"]
            space = PLANT
        else:
            given = ["report_period:=0.2"] if name in ("fault_classifier", *SUITES["one"]) else []
            space = next(suite for suite, names in SUITES.items() if name in names)
        pairs = [part for value in given for part in ("-p", value)]
        return [str(command_path(name)), *ros, "-r", f"__ns:=/{space}", *pairs]

    @contextmanager
    def _running(self) -> Iterator[None]:
        self._relay = Relay(self._said)
        self._course = (self._crew.logs / "course.txt").open("w", encoding="utf-8", buffering=1)
        try:
            for name in (SIMULATOR, *(name for names in SUITES.values() for name in names)):
                self._crew.start(name)
            yield
        finally:
            for member in self._crew.members.values():
                if member.popen.poll() is None:
                    member.popen.kill()
            self._relay.close()
            self._course.close()

    def _await_nodes(self) -> None:
        names = [name for names in SUITES.values() for name in names]
        self._until(lambda: self._relay.is_simulator_ready and self._relay.now_ns, "the simulator")
        self._until(lambda: all(map(self._crew.hears, names)), "all nodes hear all")

    def _said(self, suite: str, state: str, usable: bool) -> None:
        self._heard += 1
        words = f"{suite}: {state}" + ("" if usable else " (held)")
        if words != self._last.get(suite):
            self._last[suite] = words
            self._note(words)
        if usable:
            self._verdicts[suite] = state, self._relay.now_ns
        if state not in FAULTLESS and state not in self._allowed:
            words = f"{state!r} ({suite}, {self._condition.words}, {self._doing})"
            self._false[words] += 1
            if self._false[words] == 1:  # to be looked into
                self._relay.write_last(self._crew.logs / f"false_word_{len(self._false)}")

    def _note(self, words: str) -> None:
        passed = self._relay.now_ns / NANOSECONDS - _START
        self._course.write(f"{time.monotonic() - self._begun:9.2f} {passed:9.2f} {words}\n")

    def _until(self, condition: Callable[[], object], what: str) -> None:
        """Drive on until something is so."""
        deadline = time.monotonic() + _STUCK_S
        while not condition():
            self._relay.spin()
            self._crew.look()
            if time.monotonic() > deadline:
                raise InputError(f"{what}: not within {_STUCK_S:g} s; see the logs")

    def _drive(self, seconds: float) -> None:
        end = self._relay.now_ns + round(seconds * NANOSECONDS)
        self._until(lambda: self._relay.now_ns >= end, f"a drive of {seconds:g} s")

    def _become(self, condition: Condition) -> None:
        """Bring a fault or take it away, and wait until that is said."""
        before, self._condition = self._condition, condition
        if condition == before:
            return
        self._doing = f"{condition.words} comes" if condition.fault else f"{before.words} goes"
        self._allowed |= _true_words(condition)
        self._set_fault(before, 0.0)
        self._set_fault(condition, condition.severity)
        self._await_verdict(self._doing)

    def _set_fault(self, condition: Condition, severity: float) -> None:
        if condition.fault:
            answer = self._relay.set_fault(condition.settings(severity))
            self._until(answer.done, "a fault is set")
            if not answer.result().result.successful:
                raise InputError(f"{condition.fault}: {answer.result().result.reason}")

    def _await_verdict(
        self,
        what: str,
        suites: Iterable[str] = SUITES,
        besides: Iterable[str] = (),
        since_ns: int | None = None,
    ) -> None:
        """Note how long it takes from a stamp, or from now on, until suites say what is so.

        `besides`: what may be said as well, and for a moment more.
        """
        self._note(f"expecting {' or '.join(self._condition.states)} after: {what}")
        since_ns = self._relay.now_ns if since_ns is None else since_ns
        wanted, taken = self._condition.states, dict.fromkeys(suites, 0.0)
        missing = set(taken)

        def found() -> bool:
            passed = (self._relay.now_ns - since_ns) / NANOSECONDS
            for suite in tuple(missing):
                state, heard_ns = self._verdicts.get(suite, ("", 0))
                if (state in wanted and heard_ns > since_ns) or passed > _GIVEN_UP:
                    taken[suite] = passed
                    missing.discard(suite)
            return not missing

        self._until(found, "a verdict")
        for seconds in taken.values():
            self._delays.add(what, seconds)
        self._allowed = _true_words(self._condition).union(besides)
        self._drive(_QUIET)
        self._allowed.difference_update(besides)

    def _interrupt(self, interruption: Interruption) -> None:
        relay = self._relay
        if isinstance(interruption, Kill):
            self._kill()
            return
        self._doing = interruption.words
        self._note(str(interruption))
        if isinstance(interruption, Jump):
            relay.shift_ns += round(interruption.by * NANOSECONDS)
        elif isinstance(interruption, Pause):
            relay.silent = {*STREAMS[interruption.streams]}
            # A sensor that is silent for seconds is called so, and rightly.
            self._allowed |= {POWER_SENSOR[POWER.index(t)].name for t in relay.silent if t in POWER}
            self._drive(interruption.length)
            relay.silent = set()
        elif isinstance(interruption, Flood):
            for suite in SUITES:
                self._flood(suite, interruption.length)
            return
        else:
            relay.resting = True
            self._drive(interruption.length)
            relay.resting = False
        self._await_verdict(self._doing)

    def _flood(self, suite: str, length: float) -> None:
        self._flooded = suite
        self._crew.start(FLOODER)
        self._until(lambda: self._crew.is_up(FLOODER), "the flood")
        self._relay.flooded = suite
        self._drive(length)
        self._crew.ask_to_end(FLOODER)
        self._relay.flooded = None
        # A node takes half a second to leave: who only waits for it sends no commands meanwhile.
        self._until(lambda: self._crew.has_ended(FLOODER), "the flood's end")
        self._crew.dismiss(FLOODER)
        self._await_verdict(self._doing, (suite,))

    def _kill(self) -> None:
        """Kill a node and start it again; each has a half of the soak without."""
        late = self._relay.now_ns > self._half
        names = (*SUITES["one"], SIMULATOR) if late else SUITES["three"]
        name = names[self._kills % len(names)]
        self._kills += 1
        self._doing = f"{name} killed"
        self._note(self._doing)
        self._crew.kill(name)
        stamp = self._relay.now_ns
        self._crew.start(name)
        if name == SIMULATOR:
            # It stands until it hears commands again, and that may be said.
            self._allowed.add(DISOBEYS.name)
            self._until(lambda: self._relay.now_ns > stamp, "the simulator is back")
        else:
            self._until(lambda: self._crew.is_up(name), f"{name} up again")
        since = self._relay.now_ns
        self._until(lambda: self._crew.hears(name), f"{name} hears again")
        self._hearing.add(self._doing, (self._relay.now_ns - since) / NANOSECONDS)
        if name == SIMULATOR:
            self._set_fault(self._condition, self._condition.severity)
            self._await_verdict(self._doing, besides=(DISOBEYS.name,))
        else:
            mine = [suite for suite in SUITES if name in SUITES[suite]]
            self._await_verdict(self._doing, mine, since_ns=since)


def _true_words(condition: Condition) -> set[str]:
    """What may be said: of a faulty robot also that something is wrong."""
    return {*condition.states, UNKNOWN.name} if condition.fault else {*condition.states}
