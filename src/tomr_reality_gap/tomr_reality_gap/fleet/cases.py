"""The cases of a fleet: folders with a description and recordings each."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from attrs import evolve, frozen

from tomr_power_model.errors import InputError
from tomr_power_model.files import real_path
from tomr_reality_gap.request import Request

ROBOT, REAL, SIM, HOLDOUT = "robot.yaml", "real", "sim", "real_holdout"


@frozen
class Case:
    """One robot with its recordings; the name is that of its folder of results."""

    name: str
    inputs: Request


@frozen
class Defaults:
    """What holds for all cases."""

    robot: str | None  # description of cases that have none of their own
    tolerance: float
    tolerances: dict[str, float]


def cases_of(given: Sequence[Path], defaults: Defaults) -> tuple[Case, ...]:
    """Cases of folders, each a case itself or a folder of cases.

    Raises:
        InputError: a folder holds no case, a case has no description, or two have one name.
    """
    found = [case for folder in given for case in _cases_in(folder, defaults)]
    taken = Counter(case.name for case in found)
    named = [
        evolve(case, name=f"{real_path(case.inputs.real[0]).parent.parent.name}_{case.name}")
        if taken[case.name] > 1
        else case
        for case in found
    ]
    twice = [name for name, count in Counter(case.name for case in named).items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]}: two cases have this name: give each once, or rename one")
    return tuple(named)


def _cases_in(folder: Path, defaults: Defaults) -> list[Case]:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder: give folders that hold {ROBOT} and {REAL}")
    folders = [folder] if _recordings(folder) else sorted(folder.iterdir())
    cases = [_case(path, defaults) for path in folders if path.is_dir() and _recordings(path)]
    if not cases:
        raise InputError(
            f"{folder}: no case in it: a case is a folder that holds {ROBOT} and the recording "
            f"{REAL}, and maybe {SIM} and {HOLDOUT}"
        )
    return cases


def _recordings(folder: Path) -> tuple[Path, ...]:
    """real, real_2, ..., without those held out."""
    paths = (path for path in folder.glob(f"{REAL}*") if not path.name.startswith(HOLDOUT))
    return tuple(sorted(paths))


def _case(folder: Path, defaults: Defaults) -> Case:
    own = folder / ROBOT
    if not own.is_file() and defaults.robot is None:
        raise InputError(f"{folder}: no {ROBOT} in it: add it, or give --robot for all")
    sim = folder / SIM
    inputs = Request(
        robot=str(own) if own.is_file() else str(defaults.robot),
        real=_recordings(folder),
        sim=sim if sim.exists() else None,
        holdout=tuple(sorted(folder.glob(f"{HOLDOUT}*"))),
        tolerance=defaults.tolerance,
        tolerances=defaults.tolerances,
    )
    return Case(real_path(folder).name, inputs)
