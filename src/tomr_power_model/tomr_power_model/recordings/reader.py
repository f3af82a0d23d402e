"""Reading a rosbag2 recording, damaged ones included, within limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from heapq import merge
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from attrs import frozen
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from tomr_power_model.errors import InputError, one_line
from tomr_power_model.limits import limits, too_large
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings.bounds import (
    TooLarge,
    begin_reading,
    bound_rosbags,
    check_chunks,
    check_disk,
    check_files,
    unpack_file,
    unpack_message,
)
from tomr_power_model.recordings.damage import copy_whole_records, is_unclosed_mcap
from tomr_power_model.recordings.definitions import check_definition
from tomr_power_model.recordings.metadata import FILE_NAME, read_metadata
from tomr_power_model.recordings.topics import absolute_topic

FILE_SUFFIXES = (".mcap", ".db3")
_ANOTHER_COPY = "make another copy of the recording, or record it again"


@frozen
class _Storage:
    """The open storage files of a recording."""

    readers: tuple[Reader, ...]
    unpack: Callable[[bytes], bytes]  # a message
    warning: str | None = None

    @property
    def message_count(self) -> int:
        return sum(reader.message_count for reader in self.readers)

    def connections(self) -> list[Connection]:
        return [item for reader in self.readers for item in reader.connections]

    def messages(
        self, connections: Sequence[Connection], start_ns: int | None
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """In the order of the receive stamps."""
        streams = []
        for reader in self.readers:
            mine = [item for item in connections if item in reader.connections]
            if mine:
                streams.append(reader.messages(mine, start=start_ns))
        for connection, stamp_ns, data in merge(*streams, key=itemgetter(1)):
            if not isinstance(stamp_ns, int) or not isinstance(data, bytes | memoryview):
                raise ValueError("no stamp or no bytes")  # sqlite3 keeps any type in any column
            yield connection, stamp_ns, self.unpack(data)


@frozen
class Recording:
    """An open recording; obtained from `open_recording`."""

    path: Path
    topics: Mapping[str, str]  # full topic name -> message type
    start_ns: int  # receive stamp of the first message [ns]
    end_ns: int  # receive stamp of the last message [ns]
    message_count: int
    warning: str | None  # one line on what is missing of a damaged recording that can be read
    _storage: _Storage

    @property
    def name(self) -> str:
        """The recording as errors name it."""
        return str(self.path)

    def messages(self, topics: Iterable[str] | None = None) -> Iterator[tuple[str, str, Any, int]]:
        """Yield (topic, type, message, receive stamp [ns]) in the order of the recording.

        Args:
            topics: names as in `topics`, with or without the leading slash; None for all.

        Raises:
            InputError: a topic that is not there or has several types, a type that is not as in
                ROS 2 Jazzy, damage, a message that cannot be decoded, or more than the limits.
        """
        connections = self._connections(topics)
        for connection in connections:
            check_definition(connection, self.name)
        return self._read(connections, jazzy_typestore().deserialize_cdr)

    def raw_messages(
        self, topics: Iterable[str] | None = None, start_ns: int | None = None
    ) -> Iterator[tuple[str, str, bytes, int]]:
        """Yield as `messages` does, from the receive stamp `start_ns` on, the CDR bytes."""
        return self._read(self._connections(topics), lambda data, _: data, start_ns)

    def _read(
        self,
        connections: Sequence[Connection],
        decode: Callable[[bytes, str], Any],
        start_ns: int | None = None,
    ) -> Iterator[tuple[str, str, Any, int]]:
        read = 0
        topic = ""
        most = limits().messages
        begin_reading()
        # Damage surfaces as some ten unrelated exceptions of rosbags, zstd, lz4 and apsw. Only
        # their code runs inside this block: an exception of the caller does not pass through.
        try:
            for connection, stamp_ns, data in self._storage.messages(connections, start_ns):
                topic = connection.topic
                message = decode(data, connection.msgtype)
                yield topic, connection.msgtype, message, stamp_ns
                read += 1
                if read > most:
                    raise TooLarge("too many messages", "messages")
                topic = ""
        except TooLarge as error:
            too_large(self.name, error.what, error.limit)
        except Exception as error:
            where = f" on {topic}" if topic else ""
            raise InputError(
                f"{self.path}: message {read + 1}{where} cannot be read ({_reason(error)}); "
                f"the recording is damaged from there on, {_ANOTHER_COPY}"
            ) from error

    def _connections(self, topics: Iterable[str] | None) -> Sequence[Connection]:
        every = self._storage.connections()
        if topics is None:
            return every
        wanted = {absolute_topic(topic) for topic in topics}
        missing = wanted.difference(self.topics)
        if missing:
            raise InputError(
                f"{self.path}: no topic {', '.join(sorted(missing))}; "
                f"the recording holds {', '.join(self.topics)}"
            )
        for topic in sorted(wanted):
            types = {item.msgtype for item in every if item.topic == topic}
            if len(types) > 1:
                raise InputError(
                    f"{self.path}: {topic} holds messages of {len(types)} types, "
                    f"{', '.join(sorted(types))}: record each on a topic of its own"
                )
        return [item for item in every if item.topic in wanted]


@contextmanager
def open_recording(path: Path | str) -> Iterator[Recording]:
    """Open a rosbag2 folder, or a bare .mcap or .db3 file, for reading.

    A folder that lost its metadata.yaml is read from its storage files. Of an mcap file that
    was never closed all whole chunks are read, and `Recording.warning` says so.

    Raises:
        InputError: the recording is missing, empty, damaged, larger than the limits, or none.
    """
    source = Path(path)
    bound_rosbags()
    with ExitStack() as stack:
        storage = _open(source, stack)
        if storage.message_count == 0:
            raise InputError(
                f"{source} holds no messages; the recorder stopped before the first one, or an "
                "sqlite3 recording was never closed: record again, to mcap"
            )
        topics = {item.topic: item.msgtype for item in storage.connections()}
        if not topics:
            raise InputError(
                f"{source} holds messages, but no topic that they belong to: its index is damaged, "
                f"{_ANOTHER_COPY}"
            )
        if not all(isinstance(text, str) for names in topics.items() for text in names):
            raise InputError(f"{source}: a topic's name or type is no text: {_ANOTHER_COPY}")
        yield Recording(
            path=source,
            topics=dict(sorted(topics.items())),
            start_ns=min(reader.start_time for reader in storage.readers),
            end_ns=max(reader.end_time for reader in storage.readers) - 1,
            message_count=storage.message_count,
            warning=storage.warning,
            storage=storage,
        )


def _open(source: Path, stack: ExitStack) -> _Storage:
    try:
        found = source.exists()
    except (OSError, ValueError):
        found = False
    if not found:
        raise InputError(f"{source} does not exist; give a rosbag2 folder, a .mcap or a .db3 file")
    # Again only library code and its many exceptions, beside our own.
    try:
        return _open_found(source, stack)
    except InputError:
        raise
    except TooLarge as error:
        too_large(str(source), error.what, error.limit)
    except Exception as error:
        raise InputError(
            f"{source} cannot be read as a recording ({_reason(error)}); {_ANOTHER_COPY}"
        ) from error


def _open_found(source: Path, stack: ExitStack) -> _Storage:
    files = _storage_files(source)
    check_files(files)
    if any(is_unclosed_mcap(file) for file in files):
        return _open_unclosed(source, files, stack)
    if not source.is_dir():
        return _Storage(_enter(files, stack), bytes)
    if not (source / FILE_NAME).exists():
        warning = f"{source} has no metadata.yaml: read without it"
        return _Storage(_enter(files, stack), bytes, warning)
    try:
        metadata = read_metadata(source)
    except InputError as error:
        raise InputError(f"{source} cannot be read as a recording: {error}") from None
    check_files(metadata.files)
    if metadata.mode == "file":
        return _Storage(_enter(_unpacked(metadata.files, stack), stack), bytes)
    return _Storage(
        _enter(metadata.files, stack), unpack_message if metadata.mode == "message" else bytes
    )


def _unpacked(files: Sequence[Path], stack: ExitStack) -> list[Path]:
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="recording-")))
    targets = [folder / file.stem for file in files]
    for file, target in zip(files, targets, strict=True):
        unpack_file(file, target)
    return targets


def _open_unclosed(source: Path, files: list[Path], stack: ExitStack) -> _Storage:
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="recording-")))
    readable: list[Path] = []
    for file in files:
        if not is_unclosed_mcap(file):
            readable.append(file)
            continue
        check_disk(file)
        try:
            if copy_whole_records(file, folder / file.name):
                readable.append(folder / file.name)
        except OSError as error:
            raise InputError(
                f"{file} was never closed and cannot be repaired: {_reason(error)}"
            ) from error
    if not readable:
        raise InputError(
            f"{source} is cut off before its first whole chunk of messages; {_ANOTHER_COPY}"
        )
    storage = _Storage(_enter(readable, stack), bytes)
    warning = (
        f"{source} is cut off or was never closed: "
        f"{storage.message_count} whole messages are read, the rest is lost"
    )
    return _Storage(storage.readers, bytes, warning)


def _storage_files(source: Path) -> list[Path]:
    """Return the storage files of a recording that can be read one by one, in order of name."""
    if not source.is_dir():
        if source.suffix not in FILE_SUFFIXES:
            raise InputError(
                f"{source} is no recording; give a rosbag2 folder, a .mcap or a .db3 file"
            )
        return [source]
    files = sorted(file for file in source.iterdir() if file.suffix in FILE_SUFFIXES)
    if not files and not (source / FILE_NAME).exists():
        raise InputError(
            f"{source} is no recording: it holds neither metadata.yaml nor a .mcap or .db3 file; "
            "give the folder that ros2 bag record made"
        )
    return files


def _enter(files: Sequence[Path], stack: ExitStack) -> tuple[Reader, ...]:
    begin_reading()
    readers = tuple(stack.enter_context(Reader(file)) for file in files)
    check_chunks(readers)
    return readers


def _reason(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "the memory does not suffice"
    text = one_line(error)[:200]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
