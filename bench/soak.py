"""A long drive with the simulated robot and both forms of the diagnosis, over DDS.

    python bench/soak.py --minutes 60 --out soak

Faults come and go, streams fall silent, clocks jump, encoders flood, nodes are killed and started
again. Minutes are the robot's. Judged: every verdict is found again within 2 s of what it needs
being back (a killed node has heard all that it listens to, for which DDS has 6 s), no fault is
named that is not there, the memory of each node stays within 5 % after warm-up, all end when asked
to and leave nothing behind. What was passed on in the 30 s before a false word is recorded as
DIR/false_word_N, for tomr_diagnose.

Exit codes: 0 all passed; 1 some did not, the table says which; 2 bad input.
"""

import argparse
import sys
from collections.abc import Sequence
from importlib.resources import as_file, files
from pathlib import Path

from soak.judge import table
from soak.relay_node import connected
from soak.stage import Soak

from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main
from tomr_power_model.files import make_folder, write_text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--minutes", type=float, default=60.0, help="of the robot (default: %(default)g)")
    add("--flood", type=float, default=20.0, help="length of a flood [s] (default: %(default)g)")
    add("--speed", type=float, default=1.0, help="robot's seconds per second")
    add("--seed", type=int, default=1)
    add("--out", type=Path, required=True, metavar="DIR", help="logs, memory and table go here")
    return parser


def _soak(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    make_folder(options.out)
    described = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
    with connected(), as_file(described) as robot:
        soak = Soak(robot, options.out, options.speed, 60.0 * options.minutes)
        items = soak.run(options.seed, options.flood)
    text = table(items)
    write_text(options.out / "table.md", text + "\n")
    print(text)
    return EXIT_OK if all(item.passed for item in items) else EXIT_MISMATCH


if __name__ == "__main__":
    sys.exit(run_main(_soak))
