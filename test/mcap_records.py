"""mcap files put together record by record, so that what they state may be wrong."""

import io
import struct
from collections.abc import Iterable
from functools import cache

from lz4.frame import LZ4FrameCompressor  # type: ignore[import-untyped]

from tomr_power_model.recordings.bounds import zstd

MAGIC = b"\x89MCAP0\r\n"
MEGA = 1 << 20


def text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def header() -> bytes:
    return MAGIC + record(0x01, text("ros2") + text("test"))


def channel(topic: str, kind: str, definition: str = "", metadata: bytes = b"") -> bytes:
    """A schema and a channel, both of the number 1."""
    schema = struct.pack("<H", 1) + text(kind) + text("ros2msg") + text(definition)
    body = struct.pack("<HH", 1, 1) + text(topic) + text("cdr")
    body += struct.pack("<I", len(metadata)) + metadata
    return record(0x03, schema) + record(0x04, body)


def message(data: bytes, stamp_ns: int) -> bytes:
    return record(0x05, struct.pack("<HIQQ", 1, 0, stamp_ns, stamp_ns) + data)


def chunk(
    compression: str, packed: bytes, stated: int, first_ns: int = 0, last_ns: int = 9
) -> bytes:
    body = struct.pack("<QQQI", first_ns, last_ns, stated, 0) + text(compression)
    return record(0x06, body + struct.pack("<Q", len(packed)) + packed)


def closing() -> bytes:
    """The end of a file without an index."""
    return record(0x0F, bytes(4)) + record(0x02, bytes(20)) + MAGIC


def indexed(head: bytes, chunks: Iterable[tuple[bytes, int, int, int]], compression: str) -> bytes:
    """A file whose index names chunks: (record, stated size, first, last stamp [ns])."""
    body = head
    index = head[len(header()) :]
    for data, stated, first_ns, last_ns in chunks:
        places = struct.pack("<HQ", 1, len(body) + len(data))
        index += record(
            0x08,
            struct.pack("<QQQQ", first_ns, last_ns, len(body), len(data))
            + struct.pack("<I", len(places))
            + places
            + struct.pack("<Q", 31)  # one entry
            + text(compression)
            + struct.pack("<QQ", len(data), stated),
        )
        body += data
    body += record(0x0F, bytes(4))
    start = len(body)
    return body + index + record(0x02, struct.pack("<QQI", start, 0, 0)) + MAGIC


@cache  # the attacks ask for the same few again and again
def zeros(compression: str, size: int) -> bytes:
    """Zeros packed into a few kilobytes."""
    block = bytes(MEGA)
    out = io.BytesIO()
    if compression == "zstd":
        packer = zstd.ZstdCompressor()
        for _ in range(size // MEGA):
            out.write(packer.compress(block))
        out.write(packer.flush())
    else:
        lz4 = LZ4FrameCompressor()
        out.write(lz4.begin())
        for _ in range(size // MEGA):
            out.write(lz4.compress(block))
        out.write(lz4.flush())
    return out.getvalue()
