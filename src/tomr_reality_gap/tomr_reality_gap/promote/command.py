"""`tomr_gap promote`: the effect's file of a law that is like a learnt term."""

import argparse
from pathlib import Path

from tomr_power_model.cli import EXIT_OK

_EPILOG = """\
examples:
  tomr_gap promote gap/robot_explained.yaml --law "power law" --out effects
  tomr_gap explain --robot my_robot.yaml --real tour3 --effects effects --out gap3
  TOMR_EFFECTS=effects tomr_diagnose tour3 --robot gap3/robot_explained.yaml

The laws, their parameters and intervals are those of the report.json beside the description.

written to --out:
  <law>_by_<variable>.py        the effect: law, units, ranges and priors from the intervals
  test_<law>_by_<variable>.py   a test of it, to be added to

The effect is a hypothesis like any other where its folder is named: by `--effects DIR`, or for all
commands and nodes by TOMR_EFFECTS=DIR. Its Python files are run: name none that you do not trust.

exit codes: 0 written; 2 bad input, or a term that no effect can stand for"""


def add_promote(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "promote",
        help="make an effect of a law that is like a learnt term",
        description="Make an effect of the vocabulary of a law that is like a learnt term.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("explained", type=Path, metavar="ROBOT_EXPLAINED.yaml", help="what explain wrote")
    add("--term", default="", metavar="NAME", help="of `unmodelled:` (default: the only one)")
    add("--law", default="", metavar="LAW", help="of the report (default: the first)")
    add("--out", type=Path, required=True, metavar="DIR", help="write here")
    parser.set_defaults(run=_promote)


def _promote(options: argparse.Namespace) -> int:
    # What fits takes a second to import: --help does without.
    from tomr_power_model.files import make_folder, write_together
    from tomr_reality_gap.promote.effect_file import effect_files
    from tomr_reality_gap.promote.learnt_law import learnt_law

    texts = effect_files(learnt_law(options.explained, options.term, options.law))
    make_folder(options.out)
    write_together({options.out / name: text for name, text in texts.items()})
    for name in texts:
        print(f"written: {options.out / name}")
    return EXIT_OK
