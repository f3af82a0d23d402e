"""Accuracy of the calibrated power model on drives that were not fitted, and its speed.

    .venv/bin/python bench/calibration.py [mujoco] [robotino] [speed] [--json FILE]

mujoco: robots whose every parameter is 5 % off their description are driven for two and a half
minutes, calibrated by tomr_calibrate and scored on other missions, transients included.
robotino: the real robot on the gray floor, fitted at 0.1 m/s and every second heading, scored at
the other headings at 0.2 and 0.3 m/s. speed: samples per second, microseconds per step.
Without a name, all three; about five minutes on two cores.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from calibration_mujoco import measure_mujoco, print_mujoco
from calibration_robotino import measure_robotino, print_robotino
from calibration_speed import measure_speed, print_speed
from rich.console import Console

from tomr_power_model.cli import EXIT_OK, run_main

PARTS: dict[str, tuple[Callable[[], Any], Callable[[Console, Any], None]]] = {
    "mujoco": (measure_mujoco, print_mujoco),
    "robotino": (measure_robotino, print_robotino),
    "speed": (measure_speed, print_speed),
}


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        prog="calibration.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers there too")
    options = parser.parse_args(arguments)
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"{min(unknown)} is no part: give some of {', '.join(PARTS)}")
    console = Console(width=120, highlight=False)
    found: dict[str, Any] = {}
    for name in options.parts or PARTS:
        measure, show = PARTS[name]
        found[name] = measure()
        show(console, found[name])
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
