"""Nodes that are asked to end together: whether all do, how soon, and with which code.

    python bench/endings.py --nodes 8 --times 60

Small nodes of the suite's kind, with twelve topics out and eight in, each heard by all others.
Fast DDS 2.14 held one in some hundred for ever (tomr_power_model/nodes/leaving.py).

Exit codes: 0 all ended with code 0; 1 some did not.
"""

import argparse
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main

_LONGEST_S = 10.0
_TOGETHER_S = 1.0  # in which they find each other
_NODE = Path(__file__).with_name("talker_node.py")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--nodes", type=int, default=8, help="at a time (default: %(default)g)")
    parser.add_argument("--times", type=int, default=60, help="(default: %(default)g)")
    return parser


def _together(count: int) -> tuple[Counter[str], float]:
    """Start nodes and end them: how often each outcome, and the longest that one took [s]."""
    command = [sys.executable, str(_NODE)]
    nodes = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        for _ in range(count)
    ]
    for node in nodes:
        assert node.stdout is not None
        node.stdout.readline()
    time.sleep(_TOGETHER_S)
    asked = time.monotonic()
    for node in nodes:
        node.terminate()
    return Counter(_ended(node, asked) for node in nodes), time.monotonic() - asked


def _ended(node: "subprocess.Popen[bytes]", asked: float) -> str:
    try:
        return f"code {node.wait(max(asked + _LONGEST_S - time.monotonic(), 0.1))}"
    except subprocess.TimeoutExpired:
        node.kill()
        node.wait()
        return "never"


def _endings(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    found: Counter[str] = Counter()
    longest = 0.0
    for _ in tqdm(range(options.times), unit="end", desc=f"{options.nodes} nodes"):
        outcomes, seconds = _together(options.nodes)
        found += outcomes
        longest = max(longest, seconds)
    print(f"{found.total()} ends, the last after {longest:.2f} s at most: {dict(found)}")
    return EXIT_OK if set(found) == {"code 0"} else EXIT_MISMATCH


if __name__ == "__main__":
    sys.exit(run_main(_endings))
