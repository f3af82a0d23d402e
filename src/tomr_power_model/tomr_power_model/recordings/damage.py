"""Reading what is left of an mcap file whose recorder was killed or whose copy broke off."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_CHUNK = 0x06
_MESSAGE = 0x05
_DATA_END = 0x0F
_FOOTER = 0x02
# A footer that names no summary makes a reader scan the file instead of its missing index.
_EMPTY_FOOTER = _RECORD_HEAD.pack(_FOOTER, 20) + bytes(20)


def is_unclosed_mcap(path: Path) -> bool:
    """Whether a file begins as mcap and does not end as one."""
    try:
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                return False
            file.seek(0, 2)
            file.seek(max(0, file.tell() - len(MAGIC)))
            return file.read() != MAGIC
    except OSError:
        return False


def copy_whole_records(source: Path, target: Path) -> int:
    """Copy the whole records of an unclosed mcap to `target` and close it; return data records.

    Data records are chunks and messages outside chunks; 0 means that nothing can be read.

    Raises:
        OSError: reading or writing failed.
    """
    end, found = _end_of_data(source)
    if found:
        with source.open("rb") as reader, target.open("wb") as writer:
            shutil.copyfileobj(reader, writer)
            writer.truncate(end)
            writer.seek(end)
            writer.write(_EMPTY_FOOTER + MAGIC)
    return found


def _end_of_data(source: Path) -> tuple[int, int]:
    """Return the offset after the last whole record and the number of data records before it."""
    size = source.stat().st_size
    end = len(MAGIC)
    found = 0
    with source.open("rb") as file:
        while end + _RECORD_HEAD.size <= size:
            file.seek(end)
            opcode, length = _RECORD_HEAD.unpack(file.read(_RECORD_HEAD.size))
            following = end + _RECORD_HEAD.size + length
            if following > size or opcode in (_DATA_END, _FOOTER):
                break
            found += opcode in (_CHUNK, _MESSAGE)
            end = following
    return end, found
