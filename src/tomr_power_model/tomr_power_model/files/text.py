"""Text files, read within a limit."""

import stat
from pathlib import Path

from tomr_power_model.errors import InputError
from tomr_power_model.limits import limits, too_large


def require_regular(path: Path) -> int:
    """Size of a file [bytes]. Raises OSError, or InputError for a device or pipe, which may have
    no end or never begin.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder: give a file")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is no ordinary file: copy what it gives to one")
    return status.st_size


def read_text(path: Path, limit: str = "text_bytes", encoding: str = "utf-8") -> str:
    """Text of a file no larger than the limit of that name.

    Raises:
        InputError: too large, no ordinary file, unreadable, or not text; the caller adds no more
            than what could be given instead.
    """
    most: int = getattr(limits(), limit)
    try:
        require_regular(path)
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read ({reason})") from None
    if len(data) > most:
        too_large(str(path), "the file is too large", limit)
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot be read as text ({error.reason})") from None
