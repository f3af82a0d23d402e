"""Whatever happens to a command, 1 is an answer and nothing else gives it."""

import os
import py_compile
import signal
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest
import rclpy
from rclpy._rclpy_pybind11 import RCLError

from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_DEFECT, run_main, run_module
from tomr_power_model.errors import InputError
from tomr_power_model.nodes.stage_node import run_node

ROOT = Path(__file__).parents[1]
SQUARE = ROOT / "bags" / "square"
DIAGNOSE = Path(sysconfig.get_path("scripts"), "tomr_diagnose")


def raising(error: BaseException) -> int:
    def main(_: object) -> int:
        raise error

    return run_main(main)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (ZeroDivisionError("by zero"), EXIT_DEFECT, "ZeroDivisionError: by zero (test_exit_codes"),
        (KeyError("a\nb"), EXIT_DEFECT, "TOMR_DEBUG=1"),
        (MemoryError(), EXIT_BAD_INPUT, "memory"),
        (PermissionError(13, "Permission denied", "x"), EXIT_BAD_INPUT, "x: Permission denied"),
        (OSError(28, "No space left on device"), 74, "output cannot be written"),
        (BrokenPipeError(), 141, ""),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_an_error_nobody_expected_is_one_line(
    error: BaseException, code: int, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert raising(error) == code
    line = capfd.readouterr().err
    assert words in line
    assert line.count("\n") == (1 if words else 0)


@pytest.mark.parametrize("size", [8, 40, 200])
def test_a_compiled_module_that_a_full_disk_cut_short(
    size: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """CPython issue 126606: it is kept so, and every later run would fail over it."""
    (tmp_path / "cut_short.py").write_text("def main():\n    return 0\n" + "x = 1\n" * 100)
    compiled = Path(py_compile.compile(str(tmp_path / "cut_short.py"), doraise=True))
    compiled.write_bytes(compiled.read_bytes()[:size])
    monkeypatch.syspath_prepend(tmp_path)
    code = run_module("cut_short")
    sys.modules.pop("cut_short", None)
    line = capsys.readouterr().err
    if size < 16:  # of a header: Python sees that itself
        assert (code, line) == (0, "")
        return
    assert code == EXIT_BAD_INPUT
    assert line == f"error: {compiled}: cut short, as a full disk leaves it: remove it\n"


def test_where_it_comes_from_is_shown_on_request(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOMR_DEBUG", "1")
    assert raising(ZeroDivisionError()) == EXIT_DEFECT
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("redirection", "code"), [("> /dev/full", 74), (">&-", 0), (">&- 2>&- <&-", 0), ("| true", 141)]
)
def test_output_that_cannot_be_written(redirection: str, code: int) -> None:
    """Closed is what the user chose; full is not."""
    script = f"{DIAGNOSE} {SQUARE} --json {redirection}; exit ${{PIPESTATUS[0]}}"
    run = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, timeout=60, env=_environment()
    )
    # A pipe may take all before its reader is gone.
    assert run.returncode in ({code, 0} if code == 141 else {code})
    assert "Traceback" not in run.stderr
    assert run.stderr.count("\n") <= 1


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("--help > /dev/full", 74),
        ("--parameters > /dev/full", 74),
        ("nowhere 2> /dev/full", EXIT_BAD_INPUT),
        ("nowhere > /dev/full 2>&1", EXIT_BAD_INPUT),
    ],
)
def test_words_that_nobody_takes(arguments: str, code: int) -> None:
    run = subprocess.run(["bash", "-c", f"{DIAGNOSE} {arguments}"], timeout=60, env=_environment())
    assert run.returncode == code


@pytest.mark.parametrize(
    "arguments",
    [
        "tomr_diagnose circle",
        "tomr_calibrate circle --robot reference --out fitted.yaml",
        "tomr_simulate square --out circle",
        "tomr_calibrate {bag} --robot reference --out circle",
    ],
)
def test_links_that_lead_in_a_circle(arguments: str, tmp_path: Path) -> None:
    (tmp_path / "circle").symlink_to("circle")
    command, *rest = arguments.format(bag=SQUARE).split()
    run = subprocess.run(
        [DIAGNOSE.with_name(command), *rest],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=tmp_path,
        env=_environment(),
    )
    assert run.returncode == EXIT_BAD_INPUT, run.stderr
    assert run.stderr.splitlines()[-1].startswith("error: ")
    assert "circle" in run.stderr


def test_a_folder_that_is_gone_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert run_main(lambda _: len(Path.cwd().name)) == EXIT_BAD_INPUT
    assert "the current folder is gone" in capsys.readouterr().err


def test_names_that_the_terminal_lacks_letters_for(tmp_path: Path) -> None:
    for name in (
        "Straße-\N{SNOWMAN}",
        "line\nbreak",
        os.fsdecode(b"\xff\xfe"),
    ):
        missing = tmp_path / name
        run = subprocess.run(
            [DIAGNOSE, missing],
            capture_output=True,
            timeout=60,
            env=_environment(PYTHONIOENCODING="ascii"),
        )
        assert run.returncode == EXIT_BAD_INPUT
        assert run.stderr.count(b"\n") == 1
        assert run.stderr.isascii()


_SLOW = """
import os, signal, sys
from importlib import abc, machinery
# A shell that starts tests in the background has SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
class Slow(abc.MetaPathFinder, abc.Loader):
    def find_spec(self, name, path=None, target=None):
        return machinery.ModuleSpec(name, self) if name == "slow" else None
    def exec_module(self, module):
        os.kill(os.getpid(), {number})
        signal.pause()
sys.meta_path.insert(0, Slow())
from tomr_power_model.cli import run_module
sys.exit(run_module("slow"))
"""


_FINALISER = """
import signal, sys
# As above.
signal.signal(signal.SIGINT, signal.default_int_handler)
class Last:
    def __del__(self):
        signal.raise_signal({number})
def main(_):
    last = Last()
    del last
    signal.pause()
from tomr_power_model.cli import run_main
sys.exit(run_main(main))
"""


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["INT", "TERM"]
)
@pytest.mark.parametrize("script", [_SLOW, _FINALISER], ids=["while loading", "in a finaliser"])
def test_a_signal_where_it_could_be_lost(script: str, number: int, code: int) -> None:
    run = subprocess.run(
        [sys.executable, "-c", script.format(number=int(number))],
        capture_output=True,
        text=True,
        timeout=30,
        env=_environment(),
    )
    assert (run.returncode, run.stderr) == (code, "interrupted\n")


_TWICE = """
import os, signal
from tomr_power_model.nodes.stage_node import StopRequest
class Last:
    def __del__(self, kill=os.kill, pid=os.getpid()):
        kill(pid, {number})
stop = StopRequest()
os.kill(os.getpid(), {number})
assert stop.is_set
last = Last()  # goes when the interpreter has put its handlers away
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["INT", "TERM"])
def test_a_second_signal_does_not_spoil_the_end_of_a_node(number: int) -> None:
    run = subprocess.run([sys.executable, "-c", _TWICE.format(number=int(number))], timeout=30)
    assert run.returncode == 0


def _environment(**more: str) -> dict[str, str]:
    return {**os.environ, **more}


def test_a_node_refuses_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refusing(error: Exception) -> Callable[..., Any]:
        return MagicMock(side_effect=error)

    monkeypatch.setattr(signal, "signal", lambda *_: None)
    assert run_node(refusing(InputError("no\nnumber")), []) == EXIT_BAD_INPUT
    assert capsys.readouterr().err == "error: no number\n"
    monkeypatch.setattr(rclpy, "init", refusing(RCLError("odd\nfile, at ./rcl.c:1")))
    assert run_node(refusing(ValueError()), []) == EXIT_BAD_INPUT
    assert capsys.readouterr().err == "error: odd file: mend the file\n"
