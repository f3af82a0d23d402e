"""The command line of the concealed benchmark."""

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
from other_sensors import SENSORS
from rich.console import Console

from concealed import tables
from concealed.catalogue import GROUPS, SMALL, catalogue
from concealed.claims import read_truths
from concealed.make import chosen, make_all
from concealed.run import read_times, run_all, tool
from concealed.score import by_group, confusion, score_all, sightings, totals
from concealed.sensors import record
from concealed.unnamed import figures, met_all
from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK
from tomr_power_model.errors import InputError

_MAKE = """\
Writes DIR/cases/<id>/{robot.yaml, sim, real, real_holdout} and DIR/truth/<id>.json, in the layout
of the recordings `concealed`. What is there already is kept: an interrupted run goes on where it
stopped. The same seed gives the same cases. About 25 s per case on one core."""

_RUN = """\
Runs `tomr_gap explain` on every folder of CASES that has no report in REPORTS yet, as a process of
its own, and keeps its report as REPORTS/<id>.json and the seconds it took. A case on which it fails
is named with its last line. Works on the recordings `concealed` as well."""
_SENSORS = """\
Writes the cases of a folder as other sensors would have recorded them, their simulations as they
are, into DIR/cases; the truth stays what it is. Works on the recordings `concealed` as well."""
_SCORE = """\
Scores a folder of reports against a folder of truths; a missing report is a miss. exact: effect and
place, with confidence of at least 0.5. class: the effect, or one that data cannot distinguish from
it, is named or among the rivals at an overlapping place. false discovery: a confident finding that
is neither, nor a deviation of the robot stated right."""
_EPILOG = """\
A look at twelve cases:
  concealed.py make --out concealed --group small
  concealed.py run concealed/cases --out reports
  concealed.py score reports concealed/truth --reported-only"""


def _make_parser(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to; required unless --list")
    parser.add_argument("--seed", type=int, default=1, help="another seed, another set (default 1)")
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="CASE", help="these cases, by name or id"
    )
    parser.add_argument(
        "--group", nargs="+", default=[], metavar="NAME", choices=(SMALL, *GROUPS),
        help="these groups: %(choices)s",
    )  # fmt: skip
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time (default 1)")
    parser.add_argument("--list", action="store_true", help="name the cases and stop")
    parser.set_defaults(command=_make)


def _make(options: argparse.Namespace) -> int:
    cases = list(chosen(catalogue(), options.seed, options.only, options.group))
    known = {word for case in cases for word in (case.name, case.identity(options.seed))}
    for word in options.only:
        if word not in known:
            raise InputError(f"--only {word!r} is no case of seed {options.seed}: see make --list")
    if options.list:
        for case in cases:
            small = "small" if case.quick else ""
            print(f"{case.identity(options.seed)}  {case.group:20} {case.name:40} {small}".rstrip())
        return EXIT_OK
    if options.out is None:
        raise InputError("--out is missing: name the folder to write the cases into")
    failed = make_all(cases, options.seed, options.out, options.jobs)
    for line in failed:
        print(f"failed: {line}")
    return EXIT_MISMATCH if failed else EXIT_OK


def _score_parser(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("reports", type=Path, metavar="REPORTS", help="folder of <id>.json")
    parser.add_argument("truth", type=Path, metavar="TRUTH", help="folder of <id>.json")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers there too")
    parser.add_argument("--png", type=Path, metavar="FILE", help="draw the confusion matrix")
    parser.add_argument(
        "--reported-only", action="store_true", help="leave out cases without a report"
    )
    parser.set_defaults(command=_score)


def _score(options: argparse.Namespace) -> int:
    if not options.reports.is_dir():
        raise InputError(f"{options.reports}: is no folder: give the one that run --out made")
    truths = read_truths(options.truth)
    outcomes = score_all(truths, options.reports, read_times(options.reports))
    if options.reported_only:
        outcomes = [item for item in outcomes if item.report is not None]
    found, groups, counts = totals(outcomes), by_group(outcomes), confusion(outcomes)
    limits = sightings(outcomes)
    console = Console(width=200, highlight=False)
    tables.print_cases(console, outcomes)
    tables.print_groups(console, groups)
    tables.print_sightings(console, limits)
    tables.print_confusion(console, counts)
    tables.print_totals(console, found)
    unnamed = met_all(truths, options.reports)
    if unnamed:
        tables.print_unnamed(console, unnamed, figures(unnamed))
    if options.png is not None:
        tables.draw_confusion(counts, options.png)
    if options.json is not None:
        document = {
            "totals": found,
            "groups": groups,
            "detection": {item.effect: attrs.asdict(item)["met"] for item in limits},
            "confusion": [[true, called, count] for (true, called), count in counts.items()],
            "cases": [
                {
                    "id": item.truth.identity,
                    "name": item.truth.name,
                    "group": item.truth.group,
                    "hits": [attrs.asdict(hit) for hit in item.hits],
                    "false": item.false,
                    "verdict_right": item.verdict_right,
                    "place": item.place,
                    "before": item.truth.before,
                    "after": item.after,
                    "oracle": item.truth.oracle,
                    "seconds": item.seconds,
                }
                for item in outcomes
            ],
        }
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return EXIT_OK


def _run_parser(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("cases", type=Path, metavar="CASES", help="folder of <id>/robot.yaml, ...")
    parser.add_argument(
        "--out", type=Path, metavar="REPORTS", required=True, help="reports go here"
    )
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time (default 1)")
    parser.add_argument("--only", nargs="+", default=[], metavar="ID", help="these cases")
    parser.add_argument("--tool", metavar="COMMAND", help="instead of the installed tomr_gap")
    parser.add_argument(
        "--without-sim", action="store_true", help="as a user who has recordings of the robot alone"
    )
    parser.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    command = tool(options.tool)
    runs = run_all(
        command,
        options.cases,
        options.out,
        options.only,
        jobs=options.jobs,
        with_sim=not options.without_sim,
    )
    failed = [run for run in runs if run.error is not None]
    for run in failed:
        print(f"failed: {run.identity}: {run.error}")
    seconds = sorted(run.seconds for run in runs)
    if seconds:
        print(f"{len(runs)} cases, {seconds[len(seconds) // 2]:.0f} s each (median)")
    return EXIT_MISMATCH if failed else EXIT_OK


def _sensors_parser(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", choices=SENSORS, metavar="KIND", help="%(choices)s")
    parser.add_argument("cases", type=Path, metavar="CASES", help="folder of <id>/robot.yaml, ...")
    parser.add_argument("--out", type=Path, metavar="DIR", required=True, help="cases go here")
    parser.set_defaults(command=_sensors)


def _sensors(options: argparse.Namespace) -> int:
    if not options.cases.is_dir():
        raise InputError(f"{options.cases}: is no folder: give one of cases")
    record(options.cases, options.kind, options.out)
    return EXIT_OK


_COMMANDS: dict[str, tuple[Callable[[argparse.ArgumentParser], None], str, str]] = {
    "make": (_make_parser, "conceal physics in simulated robots and record them", _MAKE),
    "sensors": (_sensors_parser, "record cases with other sensors", _SENSORS),
    "run": (_run_parser, "let the tool explain a folder of cases", _RUN),
    "score": (_score_parser, "hold reports against the truth", _SCORE),
}


def main(arguments: Sequence[str] | None) -> int:
    """Run one of the commands."""
    parser = argparse.ArgumentParser(
        prog="concealed.py",
        description=__doc__,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, (fill, summary, description) in _COMMANDS.items():
        fill(
            commands.add_parser(
                name,
                help=summary,
                description=description,
                formatter_class=argparse.RawDescriptionHelpFormatter,
            )
        )
    options = parser.parse_args(arguments)
    code: int = options.command(options)
    return code
