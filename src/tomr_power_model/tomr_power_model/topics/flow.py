"""How much of a topic a node takes: no flood may keep it from the other topics."""

import struct

from tomr_power_model.limits import limits
from tomr_power_model.messages.plain import NANOSECONDS

_STAMP = struct.Struct("<iI")
_HEAD = 4  # bytes of CDR before the first field
_LITTLE_ENDIAN = 1


class Flow:
    """Lets so many messages through in a second of their stamps, more only in a short burst.

    A node that cannot keep up with one topic falls behind on all, by different times, because
    queues hold a number of messages: it would compare what was not at the same time.
    """

    def __init__(self, has_header: bool) -> None:
        """`has_header`: whether messages begin with a stamp."""
        self._has_header = has_header
        self._rate = float(limits().topic_rate)
        self._left = self._rate
        self._last_ns: int | None = None

    def refuses(self, data: bytes, now_ns: int) -> str | None:
        """Why a serialised message that comes at `now_ns` is left out, or None."""
        if len(data) > limits().topic_message_bytes:
            return f"a message of {len(data):,} bytes: left out"
        stamp_ns = self.stamp_of(data) or now_ns
        if self._last_ns is not None:
            passed = abs(stamp_ns - self._last_ns) / NANOSECONDS
            self._left = min(self._rate, self._left + passed * self._rate)
        self._last_ns = stamp_ns
        if self._left < 1.0:
            return f"more than {self._rate:g} messages a second: the others are left out"
        self._left -= 1.0
        return None

    def stamp_of(self, data: bytes) -> int:
        """Stamp of a serialised message [ns], 0 where there is none."""
        if not self._has_header or len(data) < _HEAD + _STAMP.size or data[1] != _LITTLE_ENDIAN:
            return 0
        seconds, rest = _STAMP.unpack_from(data, _HEAD)
        return int(seconds) * NANOSECONDS + int(rest)
