"""The processes of a soak: started, killed, started again, their memory, what they leave behind."""

import contextlib
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

from attrs import define, field
from processes import resident_mb

from soak.judge import Item, Process
from tomr_demo import bound
from tomr_power_model.nodes.stage_node import HEARD

_MARK = "TOMR_SOAK"  # in the environment of every process, whoever starts it
_END_S = 5.0  # in which a node must end when asked to
_SAMPLE_S = 2.0  # between two looks at memory
_UP = "publishes "  # said by a node that is complete


@define
class Member:
    """A node: its command, its process, its memory."""

    command: Sequence[str]
    popen: "subprocess.Popen[bytes]"
    log: Path
    memory: Process
    since: float  # monotonic [s]


@define
class Crew:
    """All nodes by name; `command(name)` returns how to start one."""

    command: Callable[[str], Sequence[str]]
    logs: Path
    members: dict[str, Member] = field(factory=dict)
    lives: list[Process] = field(factory=list)
    _token: str = field(factory=lambda: uuid.uuid4().hex)
    _sampled: float = 0.0
    _bad: list[str] = field(factory=list)

    def start(self, name: str) -> None:
        """Start a node, bound to the life of this process."""
        command = [
            sys.executable,
            "-I",
            "-S",
            bound.__file__,
            str(os.getpid()),
            *self.command(name),
        ]
        log = self.logs / f"{len(self.lives):03}_{name}.log"
        with log.open("wb") as stream:
            popen = subprocess.Popen(
                command,
                env={**os.environ, _MARK: self._token, "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        life = Process(name)
        self.lives.append(life)
        self.members[name] = Member(command, popen, log, life, time.monotonic())

    def kill(self, name: str) -> None:
        """Kill a node without a word."""
        popen = self.members[name].popen
        popen.kill()
        popen.wait()

    def ask_to_end(self, name: str) -> None:
        """Of a node that is needed no more, as its user would."""
        self.members[name].popen.terminate()

    def has_ended(self, name: str) -> bool:
        """Whether a node that was asked to has."""
        return self.members[name].popen.poll() is not None

    def dismiss(self, name: str) -> None:
        """Note how a node ended that was asked to; it is awaited where it has not yet."""
        self._await(name, self.members.pop(name))

    def is_up(self, name: str) -> bool:
        """Whether a node has said what it listens to and publishes."""
        return self._has_said(name, _UP)

    def hears(self, name: str) -> bool:
        """Whether a node has said that it has heard all that it listens to."""
        return self._has_said(name, HEARD)

    def _has_said(self, name: str, words: str) -> bool:
        return words in self.members[name].log.read_text("utf-8", "replace")

    def look(self) -> None:
        """Note the memory of all, from time to time."""
        now = time.monotonic()
        if now - self._sampled < _SAMPLE_S:
            return
        self._sampled = now
        for member in self.members.values():
            with contextlib.suppress(FileNotFoundError, IndexError):  # ended meanwhile
                member.memory.samples.append((now - member.since, resident_mb(member.popen.pid)))

    def ended(self) -> list[str]:
        """Nodes that ended without being asked to."""
        return [name for name, member in self.members.items() if member.popen.poll() is not None]

    def end(self) -> list[Item]:
        """End all; say how they did, and what was left."""
        self._bad += [f"{name} ended by itself" for name in self.ended()]
        for member in self.members.values():
            member.popen.terminate()
        for name, member in self.members.items():
            self._await(name, member)
        left = _marked(self._token)
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        traces = [life.name for life, text in self._texts() if "Traceback" in text]
        return [
            Item(
                "nodes end when asked to, and only then",
                ", ".join(self._bad) or "all did",
                not self._bad,
            ),
            Item("processes left behind", str(len(left)), not left),
            Item("tracebacks in logs", ", ".join(traces) or "none", not traces),
        ]

    def _await(self, name: str, member: Member) -> None:
        try:
            code = member.popen.wait(_END_S)
        except subprocess.TimeoutExpired:
            member.popen.kill()
            code = member.popen.wait()
        if code:
            self._bad.append(f"{name}: code {code}")

    def _texts(self) -> list[tuple[Process, str]]:
        logs = sorted(self.logs.glob("[0-9][0-9][0-9]_*.log"))
        texts = (log.read_text("utf-8", "replace") for log in logs)
        return list(zip(self.lives, texts, strict=True))


def _marked(token: str) -> list[int]:
    """Processes that carry a mark in their environment."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # ended, or another user's
            if f"{_MARK}={token}".encode() in (entry / "environ").read_bytes():
                found.append(int(entry.name))
    return found
