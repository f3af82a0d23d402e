"""What the commands are given: recordings, a description and how exact it is taken to be."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from attrs import evolve

from tomr_power_model.errors import InputError
from tomr_power_model.files import real_path
from tomr_power_model.robot import shipped_robots
from tomr_reality_gap.request import DEFAULT_TOLERANCE, Request


def add_inputs(parser: argparse.ArgumentParser) -> None:
    """Options that `inputs_of` reads."""
    add = parser.add_argument
    add("--robot", required=True, help=f"robot.yaml, or one of {', '.join(shipped_robots())}")
    add(
        "--real",
        nargs="+",
        action="extend",
        type=Path,
        required=True,
        metavar="BAG",
        help="recordings of the real robot",
    )
    add(
        "--sim",
        type=Path,
        metavar="BAG",
        help="recording of the simulation, driven with the same commands",
    )
    add(
        "--holdout",
        nargs="+",
        action="extend",
        type=Path,
        default=[],
        metavar="BAG",
        help="real recordings that are scored only",
    )
    add(
        "--skip",
        action="append",
        default=[],
        metavar="BAG=FROM:TO",
        help="leave out what was measured then [s]; repeatable",
    )
    add(
        "--effects",
        type=Path,
        metavar="DIR",
        help="run the Python files there, effects of your own: trust them",
    )
    add_tolerance(parser)


def add_tolerance(parser: argparse.ArgumentParser) -> None:
    """The option that `tolerances_of` reads."""
    parser.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="REL or KEY=REL",
        help="how far values, or this one, may be off; repeatable",
    )


def add_quiet(parser: argparse.ArgumentParser) -> None:
    """The option to print nothing."""
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")


def inputs_of(options: argparse.Namespace) -> Request:
    """The inputs. Raises InputError for what cannot be meant."""
    if options.effects is not None:
        from tomr_power_model.effects.user import load_effects

        load_effects(options.effects)
    tolerance, tolerances = tolerances_of(options.tolerance)
    seen: dict[Path, str] = {}
    given = [("--real", path) for path in options.real]
    given += [("--holdout", path) for path in options.holdout]
    given += [("--sim", options.sim)] if options.sim is not None else []
    for option, path in given:
        if not path.exists():
            raise InputError(f"{option} {path}: no such recording: give a folder or file of a bag")
        first = seen.setdefault(real_path(path), option)
        if first != option:
            raise InputError(f"{option} {path}: it is given as {first}, too: give it once")
    request = Request(
        robot=options.robot,
        real=tuple(dict.fromkeys(options.real)),
        sim=options.sim,
        holdout=tuple(dict.fromkeys(options.holdout)),
        tolerance=tolerance,
        tolerances=tolerances,
    )
    if not options.skip:
        return request
    # What fits takes a second to import: --help does without.
    from tomr_power_model.drive.cut import skips_of

    return evolve(request, skips=skips_of(options.skip, request.recordings))


def tolerances_of(given: Sequence[str]) -> tuple[float, dict[str, float]]:
    """The general tolerance and those of single values, from REL and KEY=REL."""
    general: float | None = None
    single: dict[str, float] = {}
    for text in given:
        key, _, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            raise InputError(
                f"--tolerance {text}: give REL or KEY=REL, e.g. 0.02 or robot.mass=0.05"
            ) from None
        if not 0.0 <= value < 1.0:
            raise InputError(f"--tolerance {text}: give a share from 0 to below 1")
        if key in single or (not key and general is not None):
            raise InputError(f"--tolerance {text}: it is given twice: give it once")
        if key:
            single[key] = value
        else:
            general = value
    return (DEFAULT_TOLERANCE if general is None else general), single
