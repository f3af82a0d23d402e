"""The experiments of Wang 2024, figure by figure: a picture, a table and the numbers of each.

    .venv/bin/python bench/experiments.py fig5 --out docs/figures
    .venv/bin/python bench/experiments.py all --out docs/figures

Writes NAME.png and NAME.json into the folder and prints the table. Under two minutes each on one
core. The figures of the real robot need its recordings (TOMR_RECORDINGS), the tables need torch.
"""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from figures.faults import fig7, fig8, fig9, fig10
from figures.heading import fig5, fig5_robotino
from figures.healthy import fig3, fig6
from figures.mass_center import fig4
from figures.real_drives import fig6_robotino
from figures.result import Missing, Result
from figures.tables import tables
from rich.console import Console

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError

EXPERIMENTS: Mapping[str, Callable[[Path], Result]] = {
    "fig3": fig3,
    "fig4": fig4,
    "fig5": fig5,
    "fig5_robotino": fig5_robotino,
    "fig6": fig6,
    "fig6_robotino": fig6_robotino,
    "fig7": fig7,
    "fig8": fig8,
    "fig9": fig9,
    "fig10": fig10,
    "tables": tables,
}


def _parser() -> argparse.ArgumentParser:
    names = "\n".join(f"  {name:15} {_line(run)}" for name, run in EXPERIMENTS.items())
    parser = argparse.ArgumentParser(
        prog="experiments.py",
        description=__doc__,
        epilog=f"figures:\n{names}\n\nexit codes: 0 done; 2 bad input, or something is missing",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("figures", nargs="+", metavar="FIGURE", help="some of those below, or all")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="where pictures and numbers go"
    )
    return parser


def _line(run: Callable[[Path], Result]) -> str:
    return (run.__doc__ or "").partition("\n")[0]


def _main(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    whole = "all" in options.figures
    for name in set(options.figures) - {"all", *EXPERIMENTS}:
        raise InputError(f"{name} is no figure: give some of {', '.join(EXPERIMENTS)}, or all")
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {options.out}: {error.strerror}: choose another folder") from None
    console = Console(width=150)
    with TemporaryDirectory(prefix="tomr-experiments-") as scratch:
        for name, run in EXPERIMENTS.items():
            if not whole and name not in options.figures:
                continue
            try:
                result = run(Path(scratch))
            except Missing as reason:
                if not whole:
                    raise
                console.print(f"{name} skipped: {reason}\n", highlight=False)
                continue
            result.show(console)
            written = ", ".join(str(path) for path in result.write(options.out, name))
            console.print(f"{written}\n", highlight=False)
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
