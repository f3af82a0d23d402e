"""`flood_node.py FROM TO SHIFT`: encoders at 5 kHz until SIGTERM.

Between two samples heard on FROM the angles are put on a line, and sent to TO, stamps moved by
SHIFT [ns].
"""

import struct
import sys

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.nodes.stage_node import SENSOR_QOS, run_node

RATE = 5000.0  # Hz
UP = "publishes a flood"
_STAMP = struct.Struct("<iI")
_HEAD = 4  # of CDR, before the first field
_GAP = 0.1  # s between two samples with nothing to fill in


class Flood(Node):
    """Fills up the time between encoder samples."""

    def __init__(self, source: str, target: str, shift_ns: int) -> None:
        super().__init__("flood")
        self._shift_ns = shift_ns
        self._last: tuple[int, list[float]] | None = None  # stamp, angles
        self._outlet = self.create_publisher(JointState, target, SENSOR_QOS)
        self.create_subscription(JointState, source, self._take, SENSOR_QOS, raw=True)
        print(UP, flush=True)

    def _take(self, data: bytes) -> None:
        message = deserialize_message(data, JointState)
        stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
        angles = list(message.position)
        places = struct.Struct(f"<{len(angles)}d")
        at = data.index(places.pack(*angles))
        if self._last is not None and 0 < stamp - self._last[0] < _GAP * NANOSECONDS:
            before, old = self._last
            count = round((stamp - before) * RATE / NANOSECONDS)
            sent = bytearray(data)
            for number in range(1, count + 1):
                share = number / count
                then = before + round(share * (stamp - before)) + self._shift_ns
                _STAMP.pack_into(sent, _HEAD, *divmod(then, NANOSECONDS))
                places.pack_into(
                    sent,
                    at,
                    *((1 - share) * a + share * b for a, b in zip(old, angles, strict=True)),
                )
                self._outlet.publish(bytes(sent))
        self._last = stamp, angles


def main() -> int:
    """Run until asked to end."""
    source, target, shift = sys.argv[1:]
    return run_node(lambda: Flood(source, target, int(shift)))


if __name__ == "__main__":
    sys.exit(main())
