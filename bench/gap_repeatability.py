"""The real Robotino, explained thrice: do disjoint sets of headings give the same values?

    .venv/bin/python bench/gap_repeatability.py --robotino gap [--surface gray green]

Works on what bench/gap_robotino.py --out gap has written: its recordings, and its description with
what the bench shows. Of each floor, headings at 0.1 m/s in three sets of twelve (from 5, 15 and 25
degrees on, 30 degrees apart) are explained, each by itself. Of every value that two sets name it is
counted whether the one lies in the interval of the other. Besides, every recording of the floors,
at all speeds, is read and aligned as for an explanation, twelve headings at a time: refusals are
listed.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from pathlib import Path
from typing import Any

from gap_robotino import drives
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from tomr_power_model.cli import run_main
from tomr_power_model.errors import InputError
from tomr_power_model.files import write_text
from tomr_reality_gap.explain import explain
from tomr_reality_gap.explanation import Estimate
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.request import Request

_FIRST = (5.0, 15.0, 25.0)  # degrees
_SPEED = 0.1  # m/s
_EVERY_FIRST, _SPEEDS = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0), (0.1, 0.2, 0.3)
_ROBOT = "robot_bench.yaml"

Values = Mapping[str, Estimate]  # by effect, place and parameter


def named(robot: Path, recordings: tuple[Path, ...]) -> Values:
    """Every value that an explanation names."""
    return {
        f"{finding.effect} at {', '.join(finding.where)}: {name}": value
        for finding in explain(Request(robot, recordings)).findings
        for name, value in finding.parameters.items()
    }


def agreements(sets: Sequence[Values]) -> Iterator[tuple[str, bool]]:
    """Of each value and pair of sets that name it: whether it is within the other's interval."""
    for one, other in permutations(sets, 2):
        for name in one.keys() & other.keys():
            yield name, other[name].low <= one[name].value <= other[name].high


def refusals(robot: Path, sets: Sequence[tuple[Path, ...]]) -> list[str]:
    """What is said of sets of recordings that cannot be explained."""
    found = []
    for recordings in tqdm(sets, desc="reading", unit="set"):
        try:
            prepared(Request(robot, recordings))
        except InputError as error:
            found.append(str(error))
    return found


def measure(folder: Path, surfaces: Sequence[str]) -> dict[str, Any]:
    """Values by floor and set, and refusals."""
    robot, bags = folder / _ROBOT, folder / "bags"
    report: dict[str, Any] = {"values": {}, "within": {}}
    for surface in surfaces:
        sets = [
            named(robot, drives(bags, surface, first, _SPEED))
            for first in tqdm(_FIRST, desc=surface, unit="set")
        ]
        report["values"][surface] = [
            {name: [item.value, item.low, item.high] for name, item in values.items()}
            for values in sets
        ]
        report["within"][surface] = sorted(agreements(sets))
    ways = product(surfaces, _EVERY_FIRST, _SPEEDS)
    groups = [drives(bags, surface, first, speed) for surface, first, speed in ways]
    report["recordings"] = sum(map(len, groups))
    report["sets"] = len(groups)
    report["refused"] = refusals(robot, groups)
    return report


def print_report(console: Console, report: Mapping[str, Any]) -> None:
    """A line for each value, and the counts."""
    table = Table(box=None)
    for heading in ("floor", "value", *(f"from {first:g} degrees" for first in _FIRST), "within"):
        table.add_column(heading, no_wrap=True)
    for surface, sets in report["values"].items():
        within = report["within"][surface]
        for name in sorted({name for values in sets for name in values}):
            cells = [
                "{:.4g} [{:.4g}, {:.4g}]".format(*values[name]) if name in values else "-"
                for values in sets
            ]
            inside = [is_within for known, is_within in within if known == name]
            table.add_row(surface, name, *cells, f"{sum(inside)} of {len(inside)}")
    console.print(table)
    pairs = [inside for within in report["within"].values() for _, inside in within]
    console.print(f"within each other's intervals: {sum(pairs)} of {len(pairs)}")
    console.print(
        f"refused: {len(report['refused'])} of {report['sets']} sets, "
        f"{report['recordings']} recordings in all"
    )
    for line in report["refused"][:5]:
        console.print(f"    {line}")


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--robotino", type=Path, required=True, metavar="DIR",
        help="what bench/gap_robotino.py has written; repeatability.json is written there",
    )  # fmt: skip
    parser.add_argument("--surface", nargs="+", default=["gray", "green"])
    options = parser.parse_args(arguments)
    if not (options.robotino / _ROBOT).exists():
        raise InputError(
            f"--robotino {options.robotino}: no {_ROBOT}: run bench/gap_robotino.py first"
        )
    report = measure(options.robotino, options.surface)
    write_text(options.robotino / "repeatability.json", json.dumps(report, indent=2) + "\n")
    print_report(Console(width=200, highlight=False, soft_wrap=True), report)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
