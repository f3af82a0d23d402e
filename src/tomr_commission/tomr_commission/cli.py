"""`tomr_commission`: from healthy drives of one robot to a diagnosis that stays switched on."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tomr_commission.request import DEFAULT_RATE, DEFAULT_TOLERANCE, CommissionRequest
from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.robot import shipped_robots

if TYPE_CHECKING:
    from tomr_commission.verdict import Reason

PLAN, DRIVE = "plan", "drive"  # the other thing that the command does

_DESCRIPTION = """\
Commission the diagnosis on one robot: find what its description leaves out, fit the bands of its
residuals, choose the alarm level for a rate of false alarms, and validate all that on a drive held
out and on faults put into it."""

_EPILOG = """\
examples:
  tomr_commission plan --robot my_robot.yaml --out mission.yaml    # the drive to record
  tomr_commission drive --robot my_robot.yaml --out tour1          # or have it driven and recorded
  tomr_commission tour1 tour2 tour3 --robot my_robot.yaml --out commissioned

Record at least four minutes of healthy driving on the floors that count, in two drives or more, as
the robot is used: starts and stops, several headings and speeds, spins, both directions, and ten
seconds of standing. The last drive is held out (the last ones until they are a minute long; of a
single one the last third).

written to --out:
  commissioned.yaml   in place of robot.yaml, for --robot and --params-file
  commission.html     for people: go or no-go, why, detection floors, what to do next
  commission.json     the same for programs
  gap/                what the description leaves out (tomr_gap explain)
  steps/              what is done; a rerun with the same inputs goes on from there

exit codes: 0 go, 1 no-go, 2 bad input"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_commission",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("bags", nargs="+", type=Path, metavar="HEALTHY_BAG", help="recordings without a fault")
    add("--robot", required=True, help=f"robot.yaml, or one of {', '.join(shipped_robots())}")
    add("--out", type=Path, required=True, metavar="DIR", help="results go here")
    add(
        "--false-alarms-per-hour",
        type=float,
        default=DEFAULT_RATE,
        metavar="RATE",
        help="that are borne (default %(default)s: one in 20 h)",
    )
    add(
        "--tolerance",
        type=float,
        default=DEFAULT_TOLERANCE,
        metavar="REL",
        help="how far values of robot.yaml may be off (default %(default)s)",
    )
    add(
        "--skip",
        action="append",
        default=[],
        metavar="BAG=FROM:TO",
        help="leave out what was measured then [s]; repeatable",
    )
    add("--quiet", action="store_true", help="print nothing but errors")
    return parser


def _request(options: argparse.Namespace) -> CommissionRequest:
    rate, tolerance = options.false_alarms_per_hour, options.tolerance
    if not 1e-4 <= rate <= 100.0:
        raise InputError(f"--false-alarms-per-hour {rate:g}: give 0.0001 to 100")
    if not 0.0 <= tolerance < 1.0:
        raise InputError(f"--tolerance {tolerance:g}: give a share from 0 to below 1")
    bags = tuple(dict.fromkeys(options.bags))
    for bag in bags:
        if not bag.exists():
            raise InputError(f"{bag}: no such recording: give a folder or file of a bag")
    if options.out.exists() and not options.out.is_dir():
        raise InputError(f"--out {options.out}: is no folder: give another")
    skips: Mapping[str, Sequence[tuple[float, float]]] = {}
    if options.skip:
        # What fits takes a second to import: --help does without.
        from tomr_power_model.drive.cut import skips_of

        skips = skips_of(options.skip, bags)
    return CommissionRequest(options.robot, bags, options.out, rate, tolerance, skips)


def _commission(options: argparse.Namespace) -> int:
    request = _request(options)
    # What follows takes seconds to import: --help does without.
    from tomr_commission.commission import STEPS, commission, write_results
    from tomr_commission.report.page import page
    from tomr_commission.report.plain import as_json, lines
    from tomr_reality_gap.progress import progress_bar

    with progress_bar(options.quiet) as progress:
        say = (lambda reasons: None) if options.quiet else _said_early
        try:
            found = commission(request, progress, say)
        except KeyboardInterrupt:
            if not options.quiet and (options.out / STEPS).is_dir():
                print(f"{options.out}: the same command goes on from here", file=sys.stderr)
            raise
    texts = {"commission.html": page(found), "commission.json": as_json(found)}
    written = write_results(found, texts)
    if not options.quiet:
        for line in lines(found):
            print(line)
        for path in written:
            print(f"written: {path}")
    return EXIT_OK if found.is_go else EXIT_MISMATCH


def _said_early(reasons: "Sequence[Reason]") -> None:
    """A no-go takes minutes less to hear of than the report takes to write."""
    from tqdm import tqdm

    for reason in reasons:
        tqdm.write(f"no-go: {reason.what}\n  -> {reason.remedy}", sys.stderr)
    if reasons:
        tqdm.write("the rest is measured for the report; Ctrl-C ends it", sys.stderr)


def _plan(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="tomr_commission plan", description="Write the drive to record as a mission file."
    )
    parser.add_argument("--robot", required=True, help="robot.yaml, or a shipped one's name")
    parser.add_argument("--out", type=Path, required=True, metavar="MISSION.yaml")
    parser.add_argument(
        "--speed", type=float, default=0.4, metavar="M/S", help="the highest (default %(default)s)"
    )
    options = parser.parse_args(arguments)
    if not 0.05 <= options.speed <= 5.0:
        raise InputError(f"--speed {options.speed:g}: give 0.05 to 5 m/s")
    from tomr_commission.plan import INSTRUCTIONS, mission_text
    from tomr_power_model.files.write import write_text
    from tomr_power_model.robot import load_robot

    write_text(options.out, mission_text(load_robot(options.robot), options.speed))
    print(f"written: {options.out}")
    print(INSTRUCTIONS.format(out=options.out, robot=options.robot))
    return EXIT_OK


def _run(arguments: Sequence[str] | None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == [PLAN]:
        return _plan(given[1:])
    if given[:1] == [DRIVE]:
        # What listens to ROS takes a second to import.
        from tomr_commission.drive_cli import drive_main

        return drive_main(given[1:])
    return _commission(_parser().parse_args(given))


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_commission`."""
    return run_main(_run, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
