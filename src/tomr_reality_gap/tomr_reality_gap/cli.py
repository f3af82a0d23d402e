"""`tomr_gap`: what a robot's simulation leaves out, found in recordings of the real one."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_reality_gap.arguments import add_inputs, add_quiet, inputs_of
from tomr_reality_gap.fleet.command import add_fleet
from tomr_reality_gap.progress import Progress, progress_bar
from tomr_reality_gap.promote.command import add_promote
from tomr_reality_gap.request import Request

if TYPE_CHECKING:  # --help does without what takes a second to import
    from tomr_reality_gap.explanation import Explanation

_DESCRIPTION = """\
Find where simulation and reality differ, say what physics was left out, model it, and show on
drives held out that it fits."""

_EPILOG = """\
examples:
  tomr_gap explain --robot my_robot.yaml --real tour1 --holdout tour2 --out gap
  tomr_gap check --robot my_robot.yaml --real tour1
  tomr_gap promote gap/robot_explained.yaml --law "power law" --out effects
  tomr_gap fleet recordings/ --out gaps

`tomr_gap explain --help` and so on say more.

exit codes: 0 done (check: match), 1 mismatch (check), 2 bad input"""

_INPUTS = """\
Record about three minutes on the floor that counts: starts and stops, several headings and
speeds, spins, both directions, and ten seconds of standing. What a drive does not excite cannot
be seen in it; the report says how large it could be. A drive for --holdout is best of another
kind: other speeds, other headings.

Without --sim the description is simulated with the recording's own commands.

--tolerance says how far a stated value may be off, as a share of it (default 0.02): a deviation
within is no finding. KEY is a value's name in robot.yaml, e.g. motor.resistance=0.05."""

_EXPLAIN_EPILOG = f"""\
examples:
  tomr_gap explain --robot my_robot.yaml --real tour1 --holdout tour2 --out gap
  tomr_gap explain --robot my_robot.yaml --real day/* --sim simulated --out gap \\
      --tolerance 0.01 --tolerance robot.mass=0.05

  tomr_gap explain --robot my_robot.yaml --real tour1 --out gap --suggest next.yaml
  tomr_simulate next.yaml --robot gap/robot_explained.yaml --out rehearsal

{_INPUTS}

written to --out:
  report.html            for people, from the top: verdict, picture, table, details
  report.json            for programs
  robot_explained.yaml   the description with what was found, if anything was

exit codes: 0 done, whatever the verdict; 2 bad input"""

_CHECK_EPILOG = f"""\
examples:
  tomr_gap check --robot my_robot.yaml --real tour1
  tomr_gap check --robot my_robot.yaml --real nightly/* --quiet || mail_someone

{_INPUTS}

exit codes: 0 match, 1 mismatch, 2 bad input"""


def _parser() -> argparse.ArgumentParser:
    verbatim = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="tomr_gap", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=verbatim
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    explain = commands.add_parser(
        "explain",
        help="say what was left out, with a report",
        description="Say what the simulation leaves out, with a report.",
        epilog=_EXPLAIN_EPILOG,
        formatter_class=verbatim,
    )
    add_inputs(explain)
    explain.add_argument("--out", type=Path, required=True, metavar="DIR", help="write here")
    explain.add_argument(
        "--suggest",
        type=Path,
        metavar="MISSION.yaml",
        help="write the drive that would separate what this one cannot",
    )
    add_quiet(explain)
    explain.set_defaults(run=_explain)
    check = commands.add_parser(
        "check",
        help="say whether simulation and recording agree, by exit code",
        description="Say whether simulation and recording agree: made for continuous integration.",
        epilog=_CHECK_EPILOG,
        formatter_class=verbatim,
    )
    add_inputs(check)
    add_quiet(check)
    check.set_defaults(run=_check)
    add_promote(commands)
    add_fleet(commands)
    return parser


def _explanation(request: Request, progress: Progress) -> "Explanation":
    from tomr_reality_gap.explain import explain

    return explain(request, progress)


def _explain(options: argparse.Namespace) -> int:
    inputs = inputs_of(options)
    if options.suggest is not None and not options.suggest.parent.is_dir():
        raise InputError(f"{options.suggest}: no folder {options.suggest.parent}: make it first")
    from tomr_power_model.files import make_folder

    make_folder(options.out)
    with progress_bar(options.quiet) as progress:
        explanation = _explanation(inputs, progress)
        # Pictures take a second and 30 MB to import: --help, `check` and the fit do without.
        from tomr_reality_gap.report.html import picture_count
        from tomr_reality_gap.report.terminal import print_explanation
        from tomr_reality_gap.report.write import report_files, write_report

        texts = report_files(
            explanation, Path(inputs.robot).name, _ticks(progress, picture_count(explanation))
        )
    suggested = explanation.suggested if options.suggest is not None else None
    write_report(options.out, texts, {options.suggest: suggested} if suggested else None)
    if not options.quiet:
        print_explanation(explanation)
        for name in texts:
            print(f"written: {options.out / name}")
        if options.suggest is not None:
            print(_on_suggestion(explanation, options.suggest))
    return EXIT_OK


def _on_suggestion(explanation: "Explanation", path: Path) -> str:
    if explanation.suggested:
        return f"written: {path}"
    return f"note: {path} is not written: no further drive is called for"


def _ticks(progress: Progress, count: int) -> Callable[[], None]:
    """Reports the pictures, one call each."""
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        progress("pictures", done / max(1, count))

    return tick


def _check(options: argparse.Namespace) -> int:
    inputs = inputs_of(options)
    with progress_bar(options.quiet) as progress:
        explanation = _explanation(inputs, progress)
    if not options.quiet:
        from tomr_reality_gap.report.terminal import print_explanation

        print_explanation(explanation)
    return EXIT_MISMATCH if explanation.verdict == "mismatch" else EXIT_OK


def _run(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    run: Callable[[argparse.Namespace], int] = options.run
    return run(options)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_gap`."""
    return run_main(_run, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
