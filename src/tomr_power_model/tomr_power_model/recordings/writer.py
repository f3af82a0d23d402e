"""Writing a rosbag2 recording."""

from __future__ import annotations

import sqlite3
from contextlib import ExitStack
from errno import EEXIST, ENOTDIR, ENOTEMPTY
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, Self

from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError

from tomr_power_model.errors import InputError
from tomr_power_model.files.paths import real_path
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings.topics import absolute_topic

ROSBAG2_VERSION: Literal[9] = 9  # what Jazzy writes
# What a full or broken disk makes of rosbags' two storages.
_FAILURES = (OSError, ValueError, sqlite3.Error, WriterError)
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}


class RecordingWriter:
    """A new rosbag2 folder, as a context manager.

    mcap chunks are compressed with zstd. The folder is made beside its place, and moved there when
    it is complete: of two that are recorded to one place, the later one fails. When the body of
    the `with` statement fails or is interrupted, what was written so far is kept as a readable
    recording whose metadata carries the entry `incomplete`.
    """

    def __init__(self, path: Path | str, storage: str = "mcap") -> None:
        """Prepare a recording at `path`, a folder that must not exist yet.

        Raises:
            InputError: the path exists, or the storage is unknown.
        """
        self.path = Path(path)
        if storage not in STORAGES:
            raise InputError(f"storage {storage!r} is unknown; choose mcap or sqlite3")
        try:
            if self.path.exists():
                raise self._exists()
        except (OSError, ValueError) as error:
            raise self._failed(error) from None
        self._store = jazzy_typestore()
        self._connections: dict[tuple[str, str], Connection] = {}
        self._storage = storage
        self._stack = ExitStack()
        self._writer: Writer

    def write(self, topic: str, type_name: str, message: object, stamp_ns: int) -> None:
        """Append a message of the Jazzy type `type_name`, received at `stamp_ns` [ns]."""
        self.write_raw(topic, type_name, self._store.serialize_cdr(message, type_name), stamp_ns)

    def write_raw(
        self, topic: str, type_name: str, data: bytes | memoryview, stamp_ns: int
    ) -> None:
        """Append a message already serialised as CDR, received at `stamp_ns` [ns]."""
        if not 0 <= stamp_ns < 2**63:
            raise InputError(
                f"{self.path}: a message on {topic} has the stamp {stamp_ns} ns, "
                "which a recording cannot hold; stamps are nanoseconds from 0 to 2^63"
            )
        connection = self._connections.get((topic, type_name))
        if connection is None:
            connection = self._connect(topic, type_name)
        try:
            self._writer.write(connection, stamp_ns, data)
        except _FAILURES as error:
            raise self._failed(error) from error

    def __enter__(self) -> Self:
        place = real_path(self.path)
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            beside = self._stack.enter_context(
                TemporaryDirectory(prefix=f".{place.name[:100]}.", suffix=".part", dir=place.parent)
            )
            self._made = Path(beside) / place.name
            storage = STORAGES[self._storage]
            self._writer = Writer(self._made, version=ROSBAG2_VERSION, storage_plugin=storage)
            if self._storage == "mcap":
                self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except _FAILURES as error:
            self._stack.close()
            raise self._failed(error) from error
        return self

    def __exit__(self, error_type: type[BaseException] | None, *_: object) -> None:
        with self._stack:
            if error_type is not None:
                self._writer.set_custom_data("incomplete", error_type.__name__)
            try:
                self._writer.close()
            except _FAILURES as error:
                raise self._failed(error) from error
            self._move()

    def _move(self) -> None:
        """Take the place, unless something has taken it: a folder cannot be renamed onto files."""
        try:
            self._made.rename(real_path(self.path))
        except OSError as error:
            taken = error.errno in (ENOTEMPTY, EEXIST, ENOTDIR)
            raise (self._exists() if taken else self._failed(error)) from None

    def _exists(self) -> InputError:
        return InputError(
            f"{self.path} exists already and is not overwritten; remove it or choose another name"
        )

    def _failed(self, error: Exception) -> Exception:
        if isinstance(error, InputError):
            return error
        reason = getattr(error, "strerror", None) or error
        return InputError(f"{self.path} cannot be written: {reason}; choose another folder")

    def _connect(self, topic: str, type_name: str) -> Connection:
        name = absolute_topic(topic)
        connection = self._connections.get((name, type_name))
        if connection is None:
            connection = self._writer.add_connection(name, type_name, typestore=self._store)
        self._connections[name, type_name] = connection
        self._connections[topic, type_name] = connection
        return connection
