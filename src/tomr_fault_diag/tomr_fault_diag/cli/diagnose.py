"""`tomr_diagnose`: what was wrong with a robot in its recordings."""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from attrs import evolve
from tqdm import tqdm

from tomr_fault_diag.diagnosis.bags import find_bags, is_bag
from tomr_fault_diag.diagnosis.key_table import summaries
from tomr_fault_diag.diagnosis.labels import RECORDED, Labels, load_labels
from tomr_fault_diag.diagnosis.replayed import (
    Failed,
    Replayed,
    Task,
    pages_for,
    replay_all,
    replay_one,
    write_page,
)
from tomr_fault_diag.diagnosis.settings import (
    STAGE_NODES,
    DiagnosisSettings,
)
from tomr_fault_diag.diagnosis.words import (
    as_json,
    bag_line,
    notes,
    phases_line,
    score_lines,
    summary_lines,
    total_line,
    verdict,
)
from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_MISMATCH, EXIT_OK, PrintAndLeave, run_main
from tomr_power_model.errors import InputError, one_line
from tomr_power_model.files import make_folder
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import load_robot, read_node_sections, shipped_robots
from tomr_power_model.robot.parameters import parse_assignments

EXIT_UNDECIDED = 3
_MOST_PHASES = 50

_EPILOG = """\
examples:
  tomr_diagnose drive.mcap --robot my_robot.yaml
  tomr_diagnose bag_folder --out diagnosed --set band.power=2.0
  tomr_diagnose bag_folder --json | jq .shares
  tomr_diagnose recordings/ --phases 5 --html pages
  tomr_diagnose recordings/ --labels labels.yaml

A label says what is true of a recording, as YAML, JSON or CSV (times in s after its first message):
  - {bag: drive_17, state: motor system fault, wheel: 2, onset: 8.0, end: 14.0, severity: 0.6}
  - {bag: drive_18}                                     # nothing is wrong
Mission files of tomr_simulate serve as well; `--labels recorded` takes what it wrote into its bags.

exit codes: 0 nothing wrong; 1 a fault was named, in any phase of any recording; 2 bad input, or
one of many recordings failed; 3 nothing wrong in the others, and in one nothing could be decided
The numbers are those that the three nodes publish on the same data."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_diagnose",
        description="Diagnose a three-wheeled omni robot from recordings of its commands, wheel "
        "encoders and motor power.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "bag", type=Path, nargs="+", help="rosbag2 folder, .mcap or .db3 file, or a folder of these"
    )
    parser.add_argument(
        "--robot",
        default="reference",
        help=f"robot.yaml, or one of {', '.join(shipped_robots())} (default: %(default)s)",
    )
    parser.add_argument(
        "--phases",
        type=int,
        default=1,
        metavar="N",
        help="diagnose on N grids of decisions, each shifted by 1/N of the period (default: 1)",
    )
    parser.add_argument(
        "--labels", metavar="PATH", help=f"score against a file, a folder of them, or `{RECORDED}`"
    )
    parser.add_argument("--html", type=Path, metavar="DIR", help="write a time line of each here")
    parser.add_argument(
        "--jobs",
        type=int,
        default=0,
        metavar="N",
        help="recordings side by side (default: one per core)",
    )
    parser.add_argument("--out", type=Path, help="write the suite's messages to this new bag")
    parser.add_argument("--namespace", help="of the robot's topics, if the bag holds several")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter; --parameters lists them",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument(
        "--parameters",
        action=PrintAndLeave,
        nargs=0,
        const=summaries,
        help="list all keys of robot.yaml",
    )
    return parser


def _tasks(options: argparse.Namespace) -> list[Task]:
    """What there is to do. Raises InputError."""
    if not 1 <= options.phases <= _MOST_PHASES:
        raise InputError(f"--phases {options.phases}: give 1 to {_MOST_PHASES}")
    if options.jobs < 0:
        raise InputError(f"--jobs {options.jobs}: give 1 or more, or 0 for one per core")
    given = read_node_sections(options.robot, STAGE_NODES)
    settings = DiagnosisSettings.of(
        {**given, **parse_assignments(options.set)}, f"--set or {options.robot}"
    )
    load_robot(options.robot)  # a bad one is no fault of the recordings
    task = Task(
        options.bag[0],
        options.robot,
        settings,
        options.namespace,
        options.phases,
        out=options.out,
        is_truth_recorded=options.labels == RECORDED,
    )
    bags = find_bags(options.bag)
    if options.out is not None and len(bags) > 1:
        raise InputError(f"--out {options.out}: give one recording with it, not {len(bags)}")
    is_file = options.labels and options.labels != RECORDED
    labels = load_labels(Path(options.labels)) if is_file else Labels(())
    strangers = labels.strangers(bags)
    if strangers:
        _report(f"note: --labels: none of the recordings is {', '.join(strangers)}")
    pages: Sequence[Path | None] = [None] * len(bags)
    if options.html is not None:
        make_folder(options.html)  # before hours of work
        pages = pages_for(options.html, bags)
    return [
        evolve(task, bag=bag, page=page, labels=labels.of(bag))
        for bag, page in zip(bags, pages, strict=True)
    ]


def _replayed_alone(task: Task) -> Replayed:
    """One recording, with a bar of its seconds."""
    with tqdm(unit="s", desc="diagnosing", disable=None, delay=1.0) as bar:

        def progress(done_ns: int) -> None:
            done = done_ns // NANOSECONDS
            if done > bar.n:
                bar.update(done - bar.n)

        return replay_one(task, progress)


def _replayed(tasks: Sequence[Task], jobs: int) -> Iterator[Replayed | Failed]:
    """Many recordings, with a bar of these."""
    workers = jobs or len(os.sched_getaffinity(0))
    done = replay_all(tasks, workers)
    yield from tqdm(done, total=len(tasks), desc="diagnosing", unit="bag", disable=None)


def _exit_code(done: Sequence[Replayed], failed: Sequence[Failed]) -> int:
    if failed:
        return EXIT_BAD_INPUT
    if any(item.has_fault for item in done):
        return EXIT_MISMATCH
    return EXIT_UNDECIDED if any(item.undecided for item in done) else EXIT_OK


def _report(line: str) -> None:
    """On stderr, in one line whatever the names in it hold."""
    print(one_line(line), file=sys.stderr)


def _scores(done: Sequence[Replayed]) -> dict[str, Any]:
    from tomr_fault_diag.diagnosis.score import Scores  # scipy takes its time to load

    for item in done:
        if not item.seen:
            _report(f"note: {item.task.bag}: nothing is said of it: not scored")
    seen = tuple(one for item in done for one in item.seen)
    if not seen:
        raise InputError("--labels: nothing is said of any of the recordings: check their names")
    return Scores(seen).as_dict()


def _print_one(item: Replayed) -> None:
    if item.undecided:
        _report(f"{item.task.bag}: {verdict(item)}")
    for line in summary_lines(item.phases[0].summary, item.start_ns):
        print(line)
    if len(item.phases) > 1:
        print(phases_line(item))


def _print_notes(item: Replayed, is_alone: bool) -> None:
    place = "" if is_alone else f"{item.task.bag}: "
    for line in notes(item):
        _report(f"note: {place}{line}")


def _print_json(
    done: Sequence[Replayed], failed: Sequence[Failed], scores: object, is_alone: bool
) -> None:
    found = {
        "recordings": [as_json(item) for item in done],
        "failed": [{"bag": str(item.task.bag), "reason": item.reason} for item in failed],
    }
    if is_alone:
        found = as_json(done[0])
    print(json.dumps(found if scores is None else {**found, "scores": scores}, indent=2))


def _print_all(done: Sequence[Replayed], failed: Sequence[Failed], is_alone: bool) -> None:
    if is_alone:
        _print_one(done[0])
        return
    for item in done:
        print(bag_line(item))
    print(total_line(done, failed))


def _diagnose(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    tasks = _tasks(options)
    is_alone = len(tasks) == 1 and is_bag(options.bag[0])
    done: list[Replayed] = []
    failed: list[Failed] = []
    for item in [_replayed_alone(tasks[0])] if is_alone else _replayed(tasks, options.jobs):
        if isinstance(item, Failed):
            failed.append(item)
            _report(f"error: {item.reason}")
        else:
            done.append(item)
    order = {task.bag: number for number, task in enumerate(tasks)}
    done.sort(key=lambda item: order[item.task.bag])
    scores = _scores(done) if options.labels and done else None
    if options.html is not None and not is_alone:
        from tomr_fault_diag.diagnosis.page import INDEX, index_page

        write_page(options.html / INDEX, index_page(done, failed, scores))
    for item in done:
        _print_notes(item, is_alone)
    if options.json:
        _print_json(done, failed, scores, is_alone)
    else:
        _print_all(done, failed, is_alone)
        for line in score_lines(scores) if scores else ():
            print(line)
    return _exit_code(done, failed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_diagnose`."""
    return run_main(_diagnose, arguments)
