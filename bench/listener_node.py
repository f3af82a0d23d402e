"""`listener_node.py FILE`: note when each diagnosis arrives on /diagnostics, until SIGTERM.

Writes to FILE one line per message: arrival on the monotonic clock [ns], stamp [ns].
"""

import sys
import time
from pathlib import Path
from struct import Struct

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from tomr_fault_diag.classifier.messages import NAME
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.nodes.stage_node import STAGE_QOS, run_node

_STAMP = Struct("<iI")
_NAME = NAME.encode()
_HEAD = 4  # of CDR, before the first field


def main(path: Path) -> int:
    """Listen, then write."""
    arrivals: list[tuple[int, int]] = []

    def note(data: bytes) -> None:
        now = time.monotonic_ns()
        if _NAME not in data:  # the other stages say there how their inputs do
            return
        seconds, nanoseconds = _STAMP.unpack_from(data, _HEAD)
        arrivals.append((now, seconds * NANOSECONDS + nanoseconds))

    def make() -> Node:
        node = Node("listener")
        node.create_subscription(DiagnosticArray, "/diagnostics", note, STAGE_QOS, raw=True)
        return node

    code = run_node(make)
    path.write_text("".join(f"{now} {stamp}\n" for now, stamp in arrivals), encoding="ascii")
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
