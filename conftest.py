"""Fixtures for tests in which real processes talk over DDS; they serve all packages and test/."""

import contextlib
import fcntl
import os
import signal
import subprocess
import sys
import sysconfig
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import gettempdir
from typing import IO, Any

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent
DOMAINS = range(1, 101)
# In the environment of every process a test starts: finds also those that left its group.
MARK = "TOMR_TEST_SPAWN"
_DOMAIN_LOCK = pytest.StashKey[IO[str]]()

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_configure(config: pytest.Config) -> None:
    """Give this pytest process, maybe one of several workers, a DDS domain of its own."""
    domain, config.stash[_DOMAIN_LOCK] = _claim_domain()
    # Commands are tried with streams that are buffered, as users have them.
    os.environ.pop("PYTHONUNBUFFERED", None)
    os.environ.update(
        ROS_DOMAIN_ID=str(domain),
        ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
        ROS_PYTHON_CHECK_FIELDS="1",
        FASTRTPS_DEFAULT_PROFILES_FILE=str(ROOT / "config" / "fastdds.xml"),
    )


def _claim_domain() -> tuple[int, IO[str]]:
    """Find a domain that no other test run on this machine uses; exit sets it free."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    start = (os.getppid() * 8 + worker) % len(DOMAINS)
    for domain in (*DOMAINS[start:], *DOMAINS[:start]):
        try:
            path = Path(gettempdir(), f"tomr-test-domain-{domain}.lock")
            lock = path.open("a")
        except PermissionError:  # another user's
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        return domain, lock
    raise pytest.UsageError("other test runs use all ROS domains from 1 to 100")


@pytest.fixture
def ros_environment() -> dict[str, str]:
    """Environment for a process of ours: this worker's domain, loopback only, checked fields."""
    environment = dict(os.environ, PYTHONUNBUFFERED="1")
    # The ROS wheels set the library path once per process tree, then a guard variable. A child
    # may be of another interpreter: it gets neither and finds its own libraries.
    environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
    paths = environment.pop("LD_LIBRARY_PATH", "").split(os.pathsep)
    if kept := [path for path in paths if path and not Path(path).is_relative_to(sys.prefix)]:
        environment["LD_LIBRARY_PATH"] = os.pathsep.join(kept)
    return environment


def _wait_until(condition: Callable[[], Any], what: str, timeout: float = 20.0) -> Any:
    deadline = time.monotonic() + timeout
    while not (result := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout:g} s: {what}")
        time.sleep(0.01)
    return result


@pytest.fixture
def wait_until() -> Callable[..., Any]:
    """`wait_until(condition, what, timeout=20.0)`: poll until true, return what it returned."""
    return _wait_until


class Spawned:
    """A process of a test: one command in a group of its own, its output kept in a file."""

    def __init__(self, command: Sequence[str | Path], env: Mapping[str, str], log: Path) -> None:
        self.command = [str(part) for part in command]
        self._log = log
        with log.open("wb") as stream:
            self.popen = subprocess.Popen(
                self.command,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        return self.popen.pid

    @property
    def output(self) -> str:
        """All it printed so far, stdout and stderr."""
        return self._log.read_text(errors="replace")

    def wait_for_output(self, text: str, timeout: float = 20.0) -> str:
        """Wait until it has printed `text`; fail at once if it ends without."""

        def printed_or_ended() -> bool:
            ended = self.popen.poll() is not None
            if text in self.output:
                return True
            if ended:
                raise AssertionError(f"{self} ended without printing {text!r}:\n{self.output}")
            return False

        _wait_until(printed_or_ended, f"{text!r} printed by {self}", timeout)
        return self.output

    def wait(self, timeout: float = 60.0) -> int:
        """Exit code of a command that ends by itself."""
        try:
            return self.popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self} still runs after {timeout:g} s:\n{self.output}") from None

    def signal(self, number: signal.Signals, *, group: bool = False) -> None:
        """Send a signal to the process, or to its group as Ctrl-C in a terminal does."""
        (os.killpg if group else os.kill)(self.pid, number)

    def stop(self, timeout: float = 10.0) -> int:
        """End it by SIGTERM and return its exit code; one that has to be killed fails."""
        if self.popen.poll() is not None:
            return self.popen.returncode
        self.popen.terminate()
        try:
            return self.popen.wait(timeout)
        except subprocess.TimeoutExpired:
            os.killpg(self.pid, signal.SIGKILL)
            self.popen.wait()
            raise AssertionError(f"{self} ignored SIGTERM for {timeout:g} s") from None

    def __str__(self) -> str:
        return f"'{' '.join(self.command)}' (pid {self.pid})"


@pytest.fixture
def spawn(ros_environment: dict[str, str], tmp_path: Path) -> Iterator[Callable[..., Spawned]]:
    """`spawn(["sim_bridge", ...], env=None)`: start a process that cannot outlive the test.

    A command without a slash is one of the environment's. At the end of the test what still runs
    is sent SIGTERM; one that has to be killed, or that left a child behind, fails the test.
    """
    token = uuid.uuid4().hex
    started: list[Spawned] = []
    logs = tmp_path / "spawned"

    def start(command: Sequence[str | Path], env: Mapping[str, str] | None = None) -> Spawned:
        program, *arguments = command
        if "/" not in str(program):
            program = Path(sysconfig.get_path("scripts"), program)
        environment = {**(ros_environment if env is None else env), MARK: token}
        logs.mkdir(exist_ok=True)
        log = logs / f"{len(started)}-{Path(program).name}.log"
        started.append(Spawned([program, *arguments], environment, log))
        return started[-1]

    yield start
    problems = []
    for process in reversed(started):
        try:
            process.stop()
        except AssertionError as error:
            problems.append(str(error))
    problems += _kill_left_behind(token)
    for process in started:  # shown by pytest if the test fails
        print(f"--- {process}, exit code {process.popen.returncode}\n{process.output[-4000:]}")
    assert not problems, "\n".join(problems)


def _kill_left_behind(token: str, grace: float = 2.0) -> list[str]:
    """Name and kill the processes that carry the mark of this test and do not end soon."""
    deadline = time.monotonic() + grace
    while (found := _marked(token)) and time.monotonic() < deadline:
        time.sleep(0.01)
    for pid in found:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return [f"left behind and killed: '{command}' (pid {pid})" for pid, command in found.items()]


def _marked(token: str) -> dict[int, str]:
    """Commands, by pid, of the running processes that inherited the mark."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile, or is not ours to read
            if f"{MARK}={token}".encode() in (folder / "environ").read_bytes():
                command = (folder / "cmdline").read_bytes().replace(b"\0", b" ")
                found[int(folder.name)] = command.decode(errors="replace").strip()
    return found
