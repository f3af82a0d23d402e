"""What rosbags unpacks and reads, held within limits.

rosbags takes the sizes in a file at their word or does without. Its table of decompressors is
where chunks are unpacked, and apsw calls a hook for each database that it opens: both are replaced
once per process. How topics were offered is of no use here, and not parsed.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from attrs import define
from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from rosbags.rosbag2 import Reader, storage_mcap, storage_sqlite3
from rosbags.rosbag2.storage_mcap import McapReader

from tomr_power_model.errors import InputError
from tomr_power_model.files import require_regular
from tomr_power_model.limits import limits

# What rosbags itself unpacks and reads databases with.
_mcap: Any = storage_mcap
_sqlite: Any = storage_sqlite3
zstd, apsw = _mcap.zstd, _sqlite.apsw

_STEPS = 1_000_000  # of sqlite's machine between two looks at how many it has made
_STEPS_PER_MESSAGE = 200
_BLOCK = 1 << 20


class TooLarge(Exception):
    """Something of a recording exceeds a limit."""

    def __init__(self, what: str, limit: str) -> None:
        super().__init__(what)
        self.what = what
        self.limit = limit


@define
class _Unpacked:
    """Bytes unpacked since a recording was opened last."""

    total: int = 0


_unpacked = _Unpacked()


@cache
def bound_rosbags() -> None:
    """Make rosbags keep to the limits in this process."""
    for name, decompressor in (("zstd", zstd.ZstdDecompressor), ("lz4", LZ4FrameDecompressor)):
        _mcap.DECOMPRESSORS[name] = _bounded(decompressor)
    for module in (_mcap, _sqlite):
        module.parse_qos = lambda _: []
    apsw.connection_hooks.append(_bound_database)


def begin_reading() -> None:
    """Count anew what is unpacked."""
    _unpacked.total = 0


def _bounded(decompressor: Any) -> Any:
    def unpack(data: bytes, size: int) -> bytes:
        if size > limits().chunk_bytes:
            raise TooLarge(f"a chunk unpacks to {size:,} bytes", "chunk_bytes")
        _unpacked.total += size
        if _unpacked.total > limits().unpacked_bytes:
            raise TooLarge("its chunks unpack to more than it may hold", "unpacked_bytes")
        # One byte more than stated shows that the statement is wrong.
        return bytes(decompressor().decompress(data, size + 1))

    return unpack


def unpack_message(data: bytes) -> bytes:
    """Unpack a message that was compressed by itself (zstd)."""
    most = limits().message_bytes
    unpacked = zstd.ZstdDecompressor().decompress(data, most + 1)
    if len(unpacked) > most:
        raise TooLarge("a message unpacks to more than it may hold", "message_bytes")
    return bytes(unpacked)


def unpack_file(source: Path, target: Path) -> None:
    """Unpack a storage file that was compressed as a whole (zstd)."""
    left = limits().unpacked_file_bytes
    with source.open("rb") as packed, zstd.open(packed, "rb") as reader, target.open("wb") as out:
        while block := reader.read(_BLOCK):
            left -= len(block)
            if left < 0:
                raise TooLarge("it unpacks to more on disk than it may", "unpacked_file_bytes")
            out.write(block)


def check_files(files: Iterable[Path]) -> None:
    """Raise InputError for storage that is no ordinary file, or too large together."""
    sizes = [require_regular(file) for file in files]
    if len(sizes) > limits().recording_files:
        raise TooLarge(f"it has {len(sizes):,} files", "recording_files")
    if sum(sizes) > limits().recording_bytes:
        raise TooLarge(f"it takes {sum(sizes):,} bytes", "recording_bytes")


def check_disk(file: Path) -> None:
    """Raise InputError where a copy of a file has no room among the temporary files."""
    needed, room = file.stat().st_size, shutil.disk_usage(gettempdir()).free
    if needed > room // 2:
        raise InputError(
            f"{file}: mending it takes {needed:,} bytes in {gettempdir()}, which has {room:,} "
            "left: set TMPDIR to a folder with more room"
        )


def check_chunks(readers: Iterable[Reader]) -> None:
    """Raise TooLarge where the chunks that have to be open at once unpack to more than they may."""
    edges: list[tuple[int, int, int]] = []
    for reader in readers:
        storage = reader.storage
        for chunk in storage.chunks if isinstance(storage, McapReader) else ():
            edges.append((chunk.message_start_time, 0, chunk.uncompressed_size))
            edges.append((chunk.message_end_time, 1, -chunk.uncompressed_size))
    at_once = most = 0
    for _, _, size in sorted(edges):
        at_once += size
        most = max(most, at_once)
    # Chunks follow one another: two meet at a stamp.
    if most > 2 * limits().chunk_bytes:
        raise TooLarge(f"chunks of the same time unpack to {most:,} bytes", "chunk_bytes")


def _bound_database(connection: Any) -> None:
    """A column may be computed, a table be a program: bound what a row holds and takes."""
    connection.limit(apsw.SQLITE_LIMIT_LENGTH, min(limits().message_bytes, 2**31 - 1))
    connection.config(apsw.SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0)
    connection.config(apsw.SQLITE_DBCONFIG_DEFENSIVE, 1)
    most = limits().messages * _STEPS_PER_MESSAGE
    made = 0

    def too_long() -> bool:
        nonlocal made
        made += _STEPS
        return made > most

    connection.set_progress_handler(too_long, _STEPS)
