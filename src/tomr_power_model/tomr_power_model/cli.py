"""What all commands share: exit codes, the form of an error, and that loading can be interrupted.

0 and 1 are answers, and nothing but an answer gives them. What a command was fed gives 2, a defect
of the command itself 70 (sysexits.h: EX_SOFTWARE), results that could not be said 74 (EX_IOERR).
"""

import _thread
import argparse
import contextlib
import errno
import os
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import NoReturn, TextIO

from tomr_power_model.errors import InputError, one_line

EXIT_OK = 0
EXIT_MISMATCH = 1
EXIT_BAD_INPUT = 2
EXIT_DEFECT = 70
EXIT_NO_OUTPUT = 74
EXIT_INTERRUPTED = 130
EXIT_PIPE_CLOSED = 141  # as a program that SIGPIPE ends
EXIT_TERMINATED = 143

DEBUG = "TOMR_DEBUG"  # environment: not empty, show where an error comes from

_UNWRITTEN = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)

_AGAIN = 0.1  # s
_signals: list[int] = []  # that asked this process to end

Main = Callable[[Sequence[str] | None], int]


def run_main(main: Main, arguments: Sequence[str] | None = None) -> int:
    """Run a command's body; whatever happens, give one line on stderr and a code that says it."""
    _prepare_streams()
    _end_cleanly_on_signals()
    try:
        with warnings.catch_warnings():
            if not (os.environ.get(DEBUG) or sys.warnoptions):
                # Of numpy and others, on what nobody can mend who runs a command.
                warnings.simplefilter("ignore")
            try:
                code = main(arguments)
            except SystemExit:  # of --help: that all of it was taken is still to be seen
                sys.stdout.flush()
                raise
        sys.stdout.flush()
        return code
    except InputError as error:
        return _fail(EXIT_BAD_INPUT, f"error: {error}")
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        # The reader of a pipe (`| head`) left before it had all.
        _drop(sys.stdout)
        return EXIT_PIPE_CLOSED
    except Exception as error:  # noqa: BLE001 the outermost place: 1 must not come of it
        return _interrupted() if _signals else _fail(*_unexpected(error))


class PrintAndLeave(argparse.Action):
    """An option, with `nargs=0`, that prints the lines that its `const` gives, and nothing else."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        for line in self.const():
            print(line)
        parser.exit()


def run_module(name: str) -> int:
    """Run `main` of a module; loading it is interrupted as cleanly as running it."""
    return run_main(lambda _: int(import_module(name).main()))


def _interrupted() -> int:
    return _fail(EXIT_TERMINATED if signal.SIGTERM in _signals else EXIT_INTERRUPTED, "interrupted")


def _unexpected(error: Exception) -> tuple[int, str]:
    """Exit code and line for what nobody expected."""
    if isinstance(error, OSError) and error.filename is None and error.errno in _UNWRITTEN:
        _drop(sys.stdout)
        return EXIT_NO_OUTPUT, f"error: the output cannot be written ({error.strerror})"
    if isinstance(error, MemoryError):
        return EXIT_BAD_INPUT, "error: the memory does not suffice: give less at a time"
    if isinstance(error, FileNotFoundError) and error.filename is None:  # of os.getcwd alone
        return EXIT_BAD_INPUT, "error: the current folder is gone: change to one that is there"
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename else ""
        return EXIT_BAD_INPUT, f"error: {name}{error.strerror or error}"
    if cut := _cut_bytecode(error):
        return EXIT_BAD_INPUT, f"error: {cut}: cut short, as a full disk leaves it: remove it"
    last = traceback.extract_tb(error.__traceback__)[-1]
    return EXIT_DEFECT, (
        f"error: a defect of this program, {type(error).__name__}: {error} "
        f"({os.path.basename(last.filename)}:{last.lineno}); please report it with the output of "
        f"the same command under {DEBUG}=1"
    )


def _cut_bytecode(error: Exception) -> str:
    """Path of the compiled module that importlib could not load; empty: it was something else.

    Python up to 3.12.7 and 3.13.0 keeps what a full disk left of one (CPython issue 126606).
    """
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    is_cut = isinstance(error, EOFError | ValueError)
    return str(frame.f_locals.get("bytecode_path") or "") if is_cut else ""


def _fail(code: int, line: str) -> int:
    if os.environ.get(DEBUG):
        traceback.print_exc()
    try:
        print(one_line(line), file=sys.stderr, flush=True)
    except OSError:
        _drop(sys.stderr)
    if not _can_print():
        _drop(sys.stdout)
    return code


def _can_print() -> bool:
    try:
        sys.stdout.flush()
    except OSError:
        return False
    return True


def _drop(stream: TextIO) -> None:
    """Send what is left to nowhere: the interpreter would fail over it while it ends."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def _prepare_streams() -> None:
    """Give closed standard streams a place, and letters that a terminal lacks a form."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            # It takes the lowest number free, which would else be that of the next file opened.
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)  # a test's stream has none
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def _end_cleanly_on_signals() -> None:
    """Let SIGINT and SIGTERM end a command as exceptions: temporary files go with it.

    An extension module that loads while one is raised may make an error of its own of it: so they
    are noted as well. Where one cannot be raised, as in a finaliser, it is raised soon after.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _leave)
    sys.unraisablehook = _unraisable


def _leave(number: int, _: object) -> NoReturn:
    _signals.append(number)
    raise KeyboardInterrupt


def _unraisable(what: "sys.UnraisableHookArgs") -> None:
    if not (_signals and issubclass(what.exc_type, KeyboardInterrupt)):
        sys.__unraisablehook__(what)
        return
    # Raised right here it would be lost as well.
    _thread.start_new_thread(_send_again, (threading.get_ident(), _signals[-1]))


def _send_again(thread: int, number: int) -> None:
    time.sleep(_AGAIN)
    with contextlib.suppress(OSError):
        signal.pthread_kill(thread, number)
