"""`tomr_calibrate`: fit a robot's description to recordings of it."""

import argparse
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from tqdm import tqdm

from tomr_power_model.calibration.calibrate import Result, Timing, align, calibrate, read_all
from tomr_power_model.calibration.fitted import fitted_text
from tomr_power_model.calibration.following import lost_wheels
from tomr_power_model.calibration.parameters import Choice
from tomr_power_model.calibration.scoring import COLUMNS
from tomr_power_model.calibration.tables import Line, rows, tables
from tomr_power_model.calibration.wang2024 import calibrate_wang2024
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.drive.clean import check_duration
from tomr_power_model.drive.cut import skips_of
from tomr_power_model.drive.excitation import check_excitation
from tomr_power_model.drive.quality import Finding, refuse, sensor_faults
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError, one_line
from tomr_power_model.estimation.parameter import Values
from tomr_power_model.files import write_together
from tomr_power_model.robot import (
    Robot,
    load_robot,
    read_description,
    read_node_sections,
    shipped_robots,
)

_MOST_NAMES = 6  # of recordings in a line
_PHYSICAL_ONLY = ("fit", "shared", "tolerance", "power_window", "squares", "report")
_WIDTH = 120  # characters; a table that is cut off says nothing

_EPILOG = """\
examples:
  tomr_calibrate tour1 tour2 --robot my_robot.yaml --out fitted.yaml --holdout tour3
  tomr_calibrate day/* --robot my_robot.yaml --out fitted.yaml --report report.html
  tomr_calibrate tour --robot my_robot.yaml --out fitted.yaml --fit robot.mass \\
      --shared physics.contact.roller_drag.coefficient --tolerance robot.mass=0.02
  tomr_calibrate tour --robot my_robot.yaml --out fitted.yaml --skip tour=8.0:14.5
  tomr_calibrate tour --robot my_robot.yaml --power-model wang2024 --out wang2024.yaml

Drive about three minutes on the floor that counts: starts and stops, several headings and speeds,
spins, and ten seconds of standing. Without --fit, mass, inertia, resistance, torque constant,
auxiliary power and the values of all effects in the description are fitted, those of wheels and
motors one by one (--shared all: together). --tolerance says how far a stated value may be off, as
a share of it and to either side, as in tomr_gap: its prior's standard deviation is REL / sqrt(3).

An accuracy is 1 - sum|P - P_model| / sum|P| over every sample of whole drives.

exit codes: 0 done, 2 bad input: a fault, a dead sensor, too little motion, another robot's file"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_calibrate",
        description="Fit a robot's description to healthy recordings of its motion and power.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("bags", nargs="+", type=Path, metavar="BAG", help="recordings to fit")
    add("--robot", required=True, help=f"robot.yaml, or one of {', '.join(shipped_robots())}")
    add("--out", type=Path, metavar="YAML", help="write the fitted robot.yaml here")
    add("--holdout", nargs="+", type=Path, default=[], metavar="BAG", help="score on these only")
    add("--report", type=Path, metavar="HTML", help="write a page with tables and pictures")
    add("--fit", action="append", default=[], metavar="KEY", help="fit this value; repeatable")
    add(
        "--shared",
        action="append",
        default=[],
        metavar="KEY",
        help="fit this as one value for all wheels instead of one each; repeatable, `all`: every",
    )
    add(
        "--tolerance",
        action="append",
        default=[],
        metavar="KEY=REL",
        help="how far this value may be off",
    )
    add("--skip", action="append", default=[], metavar="BAG=FROM:TO", help="leave out [s]")
    add("--namespace", help="of the robot's topics, if a bag holds several")
    add(
        "--power-window",
        type=float,
        metavar="S",
        help="the power sensor's average (default: sensors.power_window in robot.yaml)",
    )
    add(
        "--encoder-window",
        type=float,
        metavar="S",
        help="span of the fit to the encoders (default: as robot.yaml gives it to power_model, "
        "else 0.05, up to 0.2 for coarse encoders; five samples at least)",
    )
    add("--squares", action="store_true", help="plain least squares, no robust loss")
    add(
        "--power-model",
        choices=("physical", "wang2024"),
        default="physical",
        help="whose values to fit: of the physical model, or the coefficients of Wang 2024",
    )
    return parser


def _numbers(given: Sequence[str], option: str) -> dict[str, float]:
    """KEY=NUMBER options."""
    found = {}
    for text in given:
        key, _, number = text.partition("=")
        try:
            found[key] = float(number)
        except ValueError:
            raise InputError(f"{option} {text}: give KEY=NUMBER, e.g. robot.mass=0.05") from None
        if not found[key] > 0.0:
            raise InputError(f"{option} {text}: give a number above 0")
    return found


@contextmanager
def _bar(title: str, total: int | None, unit: str) -> Iterator[Callable[[], None]]:
    with tqdm(total=total, desc=title, unit=unit, disable=None, leave=False, delay=1.0) as bar:
        yield lambda: cast(None, bar.update())


def _timing(options: argparse.Namespace) -> Timing:
    span = options.encoder_window
    if span is None:
        span = read_node_sections(options.robot, ["power_model"]).get("encoder_window")
    for name, value in (("--encoder-window", span), ("--power-window", options.power_window)):
        if value is not None and not (isinstance(value, int | float) and 0.0 < value <= 1.0):
            raise InputError(f"{name} {value}: give seconds above 0 and up to 1")
    return Timing(None if span is None else float(span), options.power_window)


def _calibrate(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    for path in (options.out, options.report):
        if path is not None and not path.parent.is_dir():
            raise InputError(f"{path}: no folder {path.parent}: make it first")
    robot = load_robot(options.robot)
    if options.power_model == "wang2024":
        return _wang2024(options, robot)
    values = read_description(options.robot)
    choice = Choice(
        keys=tuple(options.fit),
        shared=tuple(options.shared),
        tolerances=_numbers(options.tolerance, "--tolerance"),
    )
    timing = _timing(options)
    drives = _drives(options, robot)
    fitted, held_out = drives[: len(options.bags)], drives[len(options.bags) :]
    samples, unseen = align(fitted, robot, timing), align(held_out, robot, timing)
    with _bar("fitting", None, "evaluation") as tick:
        result = calibrate(
            values,
            options.robot,
            samples,
            unseen,
            choice=choice,
            robust=not options.squares,
            tick=tick,
        )
    _print(result, [note for item in drives for note in item.notes])
    texts: dict[Path, str] = {}
    if options.out is not None:
        texts[options.out] = _fitted_text(options.robot, values, result)
    if options.report is not None:
        # Pictures take a second to import: --help and a plain fit do without.
        from tomr_power_model.calibration.report import report_page

        with _bar("report", None, "picture") as tick:
            texts[options.report] = report_page(result, options.robot, tick)
    write_together(texts)
    return EXIT_OK


def _wang2024(options: argparse.Namespace, robot: Robot) -> int:
    """Fit the paper's coefficients in place of the description's values."""
    for name in _PHYSICAL_ONLY:
        if getattr(options, name):
            option = "--" + name.replace("_", "-")
            raise InputError(f"{option} is for the physical model: leave it out for wang2024")
    timing = _timing(options)
    drives = _drives(options, robot)
    count = len(options.bags)
    with _bar("fitting", None, "evaluation"):
        found = calibrate_wang2024(robot, drives[:count], drives[count:], timing.span)
    console = _console()
    shown = ("held out, not fitted", found.held_out), ("fitted", found.fitted)
    _print_scores(console, [(title, lines) for title, lines in shown if lines])
    _say(console, [note for item in drives for note in item.notes], held_out=bool(found.held_out))
    if options.out is not None:
        bags = _listed([item.name for item in found.fitted])
        note = f"By tomr_calibrate from {bags}, for {Path(options.robot).name}."
        write_together({options.out: found.coefficients.text(note)})
        name = shlex.quote(str(options.out))
        console.print(
            f"try it: tomr_diagnose BAG --robot {shlex.quote(options.robot)} --set "
            f"power_model=wang2024 --set wang2024.coefficients={name}",
            markup=False,
        )
    return EXIT_OK


def _drives(options: argparse.Namespace, robot: Robot) -> tuple[Drive, ...]:
    """The recordings, those to fit before those held out, all found to be healthy."""
    bags = [*options.bags, *options.holdout]
    skips = skips_of(options.skip, bags)
    with _bar("reading", len(bags), "bag") as tick:
        drives = read_all(bags, robot, options.namespace, skips, tick=tick)
    check_duration(drives[: len(options.bags)])
    check_excitation(drives[: len(options.bags)], robot)
    findings: list[Finding] = []
    with _bar("looking for faults", len(bags), "bag") as tick:
        for item in drives:
            findings += [*sensor_faults(item, robot), *lost_wheels(item, robot)]
            tick()
    refuse(findings)
    return drives


def _fitted_text(source: str, values: Values, result: Result) -> str:
    """The fitted robot.yaml with its provenance."""
    names = [item.name for item in result.samples]
    unseen = [item.name for item in result.held_out]
    ours, theirs = result.scores.whole, result.held_out_scores.whole
    assert ours is not None
    header = [
        f"Fitted by tomr_calibrate from {Path(source).name} and {_listed(names)}.",
        f"Accuracy on these drives: {_accuracies(ours.accuracy)}.",
    ]
    provenance: dict[str, object] = {
        "description": Path(source).name,
        "bags": names,
        "seconds": round(ours.seconds, 1),
    }
    if theirs is not None:
        header.append(f"On {_listed(unseen)}, not fitted: {_accuracies(theirs.accuracy)}.")
        provenance["held_out.bags"] = unseen
    header += [f"Beware: {line}" for line in result.warnings]
    return fitted_text(
        source,
        values,
        result.parameters,
        [float(number) for number in result.fitted.numbers],
        half_widths=[float(half) for half in result.half_widths],
        header=header,
        provenance=provenance,
    )


def _listed(names: Sequence[str]) -> str:
    """Some of the names in words."""
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _accuracies(numbers: Sequence[float]) -> str:
    parts = [
        f"{name} {100 * number:.1f} %"
        for name, number in zip(COLUMNS, numbers, strict=True)
        if number == number
    ]
    return ", ".join(parts)


def _print(result: Result, notes: Sequence[str]) -> None:
    console = _console()
    values = _table("value", "fitted", "95 %", "unit", "before", "left")
    for row in rows(result):
        style = "yellow" if row.open else None
        cells = (row.key, row.fitted, row.half, row.unit, row.prior, row.left)
        values.add_row(*cells, style=style)
    console.print(values)
    console.print("left: of the uncertainty before\n")
    _print_scores(console, tables(result))
    _say(console, [*notes, *result.notes], held_out=bool(result.held_out))
    for text in result.warnings:
        console.print(f"warning: {one_line(text)}", markup=False, style="yellow")


def _console() -> Console:
    console = Console(highlight=False, soft_wrap=True)
    console.width = max(console.width, _WIDTH)
    return console


def _print_scores(console: Console, found: Iterable[tuple[str, Sequence[Line]]]) -> None:
    scores = _table("accuracy, %", "s", *COLUMNS)
    for title, lines in found:
        scores.add_row(title, style="bold")
        for line in lines:
            figures = (f"{100 * value:.1f}" if value == value else "-" for value in line.values)
            name = escape(one_line(line.name))
            scores.add_row(f"  {name}", f"{line.seconds:.0f}", *figures)
    console.print(scores)


def _say(console: Console, notes: Sequence[str], *, held_out: bool) -> None:
    for text in notes:
        console.print(f"note: {one_line(text)}", markup=False)
    if not held_out:
        console.print("note: no --holdout: the figures are those of the fitted drives")


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left", no_wrap=True)
    return table


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_calibrate`."""
    return run_main(_calibrate, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
