"""Reading a rosbag2 recording, damaged ones included."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from attrs import frozen
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings.damage import copy_whole_records, is_unclosed_mcap
from tomr_power_model.recordings.topics import absolute_topic

FILE_SUFFIXES = (".mcap", ".db3")
_ANOTHER_COPY = "make another copy of the recording, or record it again"


@frozen
class Recording:
    """An open recording; obtained from `open_recording`."""

    path: Path
    topics: Mapping[str, str]  # full topic name -> message type
    start_ns: int  # receive stamp of the first message [ns]
    end_ns: int  # receive stamp of the last message [ns]
    message_count: int
    warning: str | None  # one line on what is missing of a damaged recording that can be read
    _reader: AnyReader

    @property
    def name(self) -> str:
        """The recording as errors name it."""
        return str(self.path)

    def messages(self, topics: Iterable[str] | None = None) -> Iterator[tuple[str, str, Any, int]]:
        """Yield (topic, type, message, receive stamp [ns]) in the order of the recording.

        Args:
            topics: names as in `topics`, with or without the leading slash; None for all.

        Raises:
            InputError: a topic that is not there, damage, or a message that cannot be decoded.
        """
        return self._read(topics, self._reader.typestore.deserialize_cdr)

    def raw_messages(
        self, topics: Iterable[str] | None = None, start_ns: int | None = None
    ) -> Iterator[tuple[str, str, bytes, int]]:
        """Yield as `messages` does, from the receive stamp `start_ns` on, the CDR bytes."""
        return self._read(topics, lambda data, _: data, start_ns)

    def _read(
        self,
        topics: Iterable[str] | None,
        decode: Callable[[bytes, str], Any],
        start_ns: int | None = None,
    ) -> Iterator[tuple[str, str, Any, int]]:
        connections = self._connections(topics)
        if not connections:
            return
        read = 0
        topic = ""
        # Damage surfaces as some ten unrelated exceptions of rosbags, zstd, lz4 and apsw. Only
        # their code runs inside this block: an exception of the caller does not pass through.
        try:
            for connection, stamp_ns, data in self._reader.messages(connections, start=start_ns):
                topic = connection.topic
                message = decode(data, connection.msgtype)
                yield topic, connection.msgtype, message, stamp_ns
                read += 1
                topic = ""
        except Exception as error:
            where = f" on {topic}" if topic else ""
            raise InputError(
                f"{self.path}: message {read + 1}{where} cannot be read ({_one_line(error)}); "
                f"the recording is damaged from there on, {_ANOTHER_COPY}"
            ) from error

    def _connections(self, topics: Iterable[str] | None) -> Collection[Connection]:
        if topics is None:
            return self._reader.connections
        wanted = {absolute_topic(topic) for topic in topics}
        missing = wanted.difference(self.topics)
        if missing:
            raise InputError(
                f"{self.path}: no topic {', '.join(sorted(missing))}; "
                f"the recording holds {', '.join(self.topics)}"
            )
        return [item for item in self._reader.connections if item.topic in wanted]


@contextmanager
def open_recording(path: Path | str) -> Iterator[Recording]:
    """Open a rosbag2 folder, or a bare .mcap or .db3 file, for reading.

    A folder that lost its metadata.yaml is read from its storage files. Of an mcap file that
    was never closed all whole chunks are read, and `Recording.warning` says so.

    Raises:
        InputError: the recording is missing, empty, damaged or no recording at all.
    """
    source = Path(path)
    with ExitStack() as stack:
        reader, warning = _open(source, stack)
        if reader.message_count == 0:
            raise InputError(
                f"{source} holds no messages; the recorder stopped before the first one, or an "
                "sqlite3 recording was never closed: record again, to mcap"
            )
        topics = {item.topic: item.msgtype for item in reader.connections}
        yield Recording(
            path=source,
            topics=dict(sorted(topics.items())),
            start_ns=reader.start_time,
            end_ns=reader.end_time - 1,
            message_count=reader.message_count,
            warning=warning,
            reader=reader,
        )


def _open(source: Path, stack: ExitStack) -> tuple[AnyReader, str | None]:
    if not source.exists():
        raise InputError(f"{source} does not exist; give a rosbag2 folder, a .mcap or a .db3 file")
    files = _storage_files(source)
    unclosed = [file for file in files if is_unclosed_mcap(file)]
    if unclosed:
        return _open_unclosed(source, files, stack)
    has_metadata = source.is_dir() and (source / "metadata.yaml").exists()
    reader = _enter(source, [source] if has_metadata else files, stack)
    missing = source.is_dir() and not has_metadata
    return reader, f"{source} has no metadata.yaml: read without it" if missing else None


def _open_unclosed(source: Path, files: list[Path], stack: ExitStack) -> tuple[AnyReader, str]:
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="recording-")))
    readable: list[Path] = []
    for file in files:
        if not is_unclosed_mcap(file):
            readable.append(file)
            continue
        try:
            if copy_whole_records(file, folder / file.name):
                readable.append(folder / file.name)
        except OSError as error:
            raise InputError(
                f"{file} was never closed and cannot be repaired: {_one_line(error)}"
            ) from error
    if not readable:
        raise InputError(
            f"{source} is cut off before its first whole chunk of messages; {_ANOTHER_COPY}"
        )
    reader = _enter(source, readable, stack)
    return reader, (
        f"{source} is cut off or was never closed: "
        f"{reader.message_count} whole messages are read, the rest is lost"
    )


def _storage_files(source: Path) -> list[Path]:
    """Return the storage files of a recording that can be read one by one, in order of name."""
    if not source.is_dir():
        if source.suffix not in FILE_SUFFIXES:
            raise InputError(
                f"{source} is no recording; give a rosbag2 folder, a .mcap or a .db3 file"
            )
        return [source]
    files = sorted(file for file in source.iterdir() if file.suffix in FILE_SUFFIXES)
    if not files and not (source / "metadata.yaml").exists():
        raise InputError(
            f"{source} is no recording: it holds neither metadata.yaml nor a .mcap or .db3 file; "
            "give the folder that ros2 bag record made"
        )
    return files


def _enter(source: Path, paths: list[Path], stack: ExitStack) -> AnyReader:
    # As in Recording._read: only library code runs in the block, and damage has many exceptions.
    try:
        return stack.enter_context(AnyReader(paths, default_typestore=jazzy_typestore()))
    except Exception as error:
        raise InputError(
            f"{source} cannot be read as a recording ({_one_line(error)}); {_ANOTHER_COPY}"
        ) from error


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split())[:200]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
