"""Processes of the benchmark: started in groups of their own, ended by pid, their CPU counted."""

import os
import signal
import subprocess
import sysconfig
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from tomr_power_model.errors import InputError

_TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
_STOP_TIMEOUT_S = 5.0


def command_path(name: str) -> Path:
    """A command of the environment that runs this."""
    return Path(sysconfig.get_path("scripts"), name)


@contextmanager
def running(
    commands: Mapping[str, Sequence[str | Path]], logs: Path
) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """Start named commands; whatever happens, none of them is left when the block ends."""
    started: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, command in commands.items():
            with (logs / f"{name}.log").open("wb") as log:
                started[name] = subprocess.Popen(
                    [str(part) for part in command],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        yield started
        for name, process in started.items():
            if process.poll() is not None:
                text = (logs / f"{name}.log").read_text(errors="replace").strip()
                last = text.splitlines()[-1] if text else "without a word"
                raise InputError(f"{name} ended with code {process.returncode}: {last}")
    finally:
        for process in started.values():
            process.terminate()
        for process in started.values():
            try:
                process.wait(_STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def cpu_seconds(pid: int) -> float:
    """User and system time of a process and all its threads [s]."""
    # Fields 14 and 15 of proc(5), counted after the name, which may hold spaces.
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_SECOND


def resident_mb(pid: int) -> float:
    """Memory that a process holds, shared libraries included [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
