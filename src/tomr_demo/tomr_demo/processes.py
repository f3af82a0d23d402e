"""The processes of the demo: started apart from the terminal, watched, and ended without fail."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from attrs import field, frozen

from tomr_power_model.cli import EXIT_BAD_INPUT
from tomr_power_model.errors import InputError

POLL = 0.02  # s
TIME_TO_END = 5.0  # s that processes have after SIGTERM
LAST_LINES = 12
_BOUND = Path(__file__).with_name("bound.py")


class DemoFailure(RuntimeError):
    """The demo cannot go on; says what happened and what the process at fault printed last."""


@frozen
class Child:
    """A process and the file with all it prints."""

    name: str
    log: Path
    popen: "subprocess.Popen[bytes]"

    def last_lines(self) -> list[str]:
        """What it printed last."""
        lines = self.log.read_text(errors="replace").splitlines()
        return [line for line in lines if line.strip()][-LAST_LINES:]

    def report(self) -> str:
        """Its last lines, indented, to stand below a message."""
        lines = self.last_lines() or ["(it printed nothing)"]
        return "\n".join([f"what {self.name} printed last:", *(f"  {line}" for line in lines)])


@frozen
class Children:
    """Processes that cannot outlive the `with` statement, nor this process."""

    logs: Path
    _running: list[Child] = field(factory=list)

    def start(self, name: str, command: Sequence[str | Path]) -> None:
        """Start a command in a session of its own: Ctrl-C in the terminal does not reach it."""
        words = [sys.executable, "-I", "-S", _BOUND, str(os.getpid()), *command]
        log = self.logs / f"{name}.log"
        with log.open("wb") as stream:
            popen = subprocess.Popen(
                [str(word) for word in words],
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._running.append(Child(name, log, popen))

    def named(self, name: str) -> Child:
        """The process of that name."""
        return next(child for child in self._running if child.name == name)

    def check(self) -> None:
        """Raise DemoFailure, or InputError if it complained of bad input, if one has ended."""
        for child in self._running:
            code = child.popen.poll()
            if code is None:
                continue
            if code == EXIT_BAD_INPUT and child.last_lines():
                raise InputError(f"{child.name}: {child.last_lines()[-1].removeprefix('error: ')}")
            how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
            raise DemoFailure(f"{child.name} ended early with {how}; {child.report()}")

    def stop(self) -> list[str]:
        """End all by SIGTERM, after a while by SIGKILL; returns the names of those killed."""
        for child in self._running:
            child.popen.terminate()
        deadline = time.monotonic() + TIME_TO_END
        while time.monotonic() < deadline and any(c.popen.poll() is None for c in self._running):
            time.sleep(POLL)
        killed = [child for child in self._running if child.popen.poll() is None]
        for child in killed:
            os.killpg(child.popen.pid, signal.SIGKILL)
        for child in self._running:
            child.popen.wait()
        self._running.clear()
        return [child.name for child in killed]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


@contextmanager
def signals_noted() -> Iterator[list[int]]:
    """Note SIGINT, SIGTERM and SIGHUP in a list instead of obeying: what runs ends in order."""
    noted: list[int] = []
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as under nohup
        numbers.append(signal.SIGHUP)
    before = {
        number: signal.signal(number, lambda received, _: noted.append(received))
        for number in numbers
    }
    try:
        yield noted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def command_of(name: str, modules: Mapping[str, str]) -> list[str | Path]:
    """A command beside this interpreter, else (a sourced ROS workspace) its module through it."""
    beside = Path(sys.executable).with_name(name)
    if os.access(beside, os.X_OK):
        return [beside]
    return [sys.executable, "-c", f"import sys; from {modules[name]} import main; sys.exit(main())"]
