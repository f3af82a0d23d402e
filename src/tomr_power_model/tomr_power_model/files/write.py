"""Files that are complete or absent, whatever ends the process, and that appear together.

Each is written beside its place and then renamed over it, an older whole one staying until then.
The folders are locked while a run's files are renamed, so that of two runs into one folder the
files of one are left, never some of each.
"""

import contextlib
import fcntl
import os
import signal
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from tempfile import mkstemp

from tomr_power_model.errors import InputError
from tomr_power_model.files.paths import real_path


def make_folder(folder: Path) -> None:
    """Make a folder for results. Raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: no folder can be made there ({_reason(error)})") from None


def write_text(path: Path, text: str) -> None:
    """Write one file, whole or not at all. Raises InputError where that cannot be."""
    write_together({path: text})


def write_bytes(path: Path, data: bytes) -> None:
    """Write one file, whole or not at all. Raises InputError where that cannot be."""
    write_together({path: data})


def write_together(contents: Mapping[Path, str | bytes], stale: Iterable[Path] = ()) -> None:
    """Write the files of one run, all or none, and remove what an earlier run left.

    Args:
        contents: text or bytes by path; the folders exist. A device or pipe is written to.
        stale: files that no longer belong to these.

    Raises:
        InputError: one cannot be written; then all stay as they were.
    """
    moves: dict[Path, Path] = {}  # temporary file -> place
    try:
        for path, content in contents.items():
            data = content if isinstance(content, bytes) else _encoded(content)
            try:
                _write_beside(path, data, moves)
            except (OSError, ValueError) as error:
                raise InputError(
                    f"{path}: cannot be written ({_reason(error)}): give another place"
                ) from None
        gone = list(stale)
        with _locked({place.parent for place in (*moves.values(), *gone)}), _uninterrupted():
            for temporary, place in list(moves.items()):
                _rename(temporary, place)
                del moves[temporary]
            for path in gone:
                path.unlink(missing_ok=True)
    finally:
        for temporary in moves:
            temporary.unlink(missing_ok=True)


def _encoded(text: str) -> bytes:
    # A name from the file system may hold what UTF-8 has no letter for.
    return text.encode("utf-8", errors="backslashreplace")


def _write_beside(path: Path, data: bytes, moves: dict[Path, Path]) -> None:
    place = real_path(path)
    mode = _mode(place)
    if mode is None:  # nothing can be renamed over a device
        with place.open("wb") as device:
            device.write(data)
        return
    handle, name = mkstemp(prefix=f".{place.name[:100]}.", suffix=".part", dir=place.parent)
    moves[Path(name)] = place
    with os.fdopen(handle, "wb") as file:
        os.fchmod(handle, mode)
        file.write(data)
        file.flush()
        os.fsync(handle)


def _mode(place: Path) -> int | None:
    """Permissions that a file at this place has, or gets; None for a device or pipe."""
    try:
        status = place.stat()
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(21, "Is a directory")
    if not stat.S_ISREG(status.st_mode):
        return None
    if not os.access(place, os.W_OK):
        raise PermissionError(13, "Permission denied")
    return stat.S_IMODE(status.st_mode)


def _rename(temporary: Path, place: Path) -> None:
    try:
        temporary.replace(place)
    except OSError as error:
        raise InputError(
            f"{place}: cannot be written ({_reason(error)}): give another place"
        ) from None


@contextlib.contextmanager
def _locked(folders: Iterable[Path]) -> Iterator[None]:
    """Hold the folders for this process, in an order that is the same for all."""
    with contextlib.ExitStack() as stack:
        for folder in sorted({real_path(folder) for folder in folders}):
            try:
                handle = os.open(folder, os.O_RDONLY)
            except OSError:  # may be written to but not read: then without
                continue
            stack.callback(os.close, handle)
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Let signals wait while files are renamed."""
    waiting = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, waiting)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)
