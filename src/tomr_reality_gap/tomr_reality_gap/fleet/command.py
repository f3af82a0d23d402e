"""`tomr_gap fleet`: many robots or recordings at a time, one report each and an overview."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import evolve
from tqdm import tqdm

from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_OK
from tomr_power_model.errors import one_line
from tomr_power_model.files import make_folder, write_together
from tomr_reality_gap.arguments import add_quiet, add_tolerance, tolerances_of
from tomr_reality_gap.fleet.cases import Defaults, cases_of

if TYPE_CHECKING:
    from tomr_reality_gap.fleet.outcome import Outcome

_EPILOG = """\
examples:
  tomr_gap fleet recordings/ --out gaps
  tomr_gap fleet robot_07 robot_12 --robot shared.yaml --out gaps
  tomr_gap fleet recordings/ --out gaps --scheduler tcp://cluster:8786

a case is a folder:
  robot.yaml      what its simulation is made of (else that of --robot)
  real            recording of the real robot; real_2 and so on are taken, too
  sim             recording of the simulation, optional
  real_holdout    recording that is scored only, optional

FOLDER is a case or a folder of cases. Cases run side by side on Dask (pip install -r
requirements-fleet.txt): on this machine's cores, or where --scheduler says; the workers there need
this package installed and see the recordings under the same paths.

written to --out:
  overview.html   all cases: verdict, findings, errors before and after
  overview.json   the same for programs
  CASE/           report.html, report.json, robot_explained.yaml, as `tomr_gap explain` writes

exit codes: 0 all explained; 2 bad input, in one case or more: the others are explained"""


def add_fleet(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "fleet",
        help="explain many cases at a time, with an overview",
        description="Explain many cases at a time, one report each and an overview.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("folders", nargs="+", type=Path, metavar="FOLDER", help="cases, or folders of cases")
    add("--out", type=Path, required=True, metavar="DIR", help="write here")
    add("--robot", help="robot.yaml of the cases that have none")
    add("--scheduler", default="local", metavar="ADDRESS", help="of Dask (default: local)")
    add_tolerance(parser)
    add_quiet(parser)
    parser.set_defaults(run=_fleet)


def _fleet(options: argparse.Namespace) -> int:
    tolerance, tolerances = tolerances_of(options.tolerance)
    cases = cases_of(options.folders, Defaults(options.robot, tolerance, tolerances))
    # What explains is imported by the workers, not by --help.
    from tomr_reality_gap.fleet import overview
    from tomr_reality_gap.fleet.outcome import explain_case
    from tomr_reality_gap.fleet.scheduler import outcomes

    make_folder(options.out)
    found: list[Outcome] = []
    disabled = True if options.quiet else None
    with tqdm(total=len(cases), desc="explaining", unit="case", disable=disabled) as bar:
        for outcome in outcomes(explain_case, cases, options.scheduler):
            found.append(_kept(outcome, options.out))
            bar.set_postfix_str(f"{outcome.name}: {outcome.verdict}", refresh=False)
            bar.update()
    write_together(
        {
            options.out / overview.HTML: overview.overview_page(found),
            options.out / overview.JSON: overview.overview_json(found),
        }
    )
    if not options.quiet:
        print(overview.counted(found))
        for item in overview.in_order(found):
            effects = ", ".join(one.effect for one in item.findings)
            print(f"  {item.name}: {item.verdict}{effects and ': ' + effects}")
        print(f"written: {options.out / overview.HTML}")
    bad = [item for item in overview.in_order(found) if not item.explained]
    for item in bad:
        print(one_line(f"error: {item.name}: {item.sentence}"), file=sys.stderr)
    return EXIT_BAD_INPUT if bad else EXIT_OK


def _kept(outcome: "Outcome", out: Path) -> "Outcome":
    """The outcome without its texts, which are written: a fleet's would fill the memory."""
    from tomr_reality_gap.report.write import write_report

    if outcome.texts:
        make_folder(out / outcome.name)
        write_report(out / outcome.name, outcome.texts)
    return evolve(outcome, texts={})
