"""What each rule of the classifier is worth: the same drives diagnosed without it.

    .venv/bin/python bench/ablation.py --keep DIR [--practice ROBOT ...]
        [--commissioned DIR ...] [--without-imu DIR ...] [--only NAME ...]

ROBOT describes the robot of `faults_practice` (what `bench/faults_practice.py explain` or
`commission` made); the other DIRs are those of bench/commissioned.py, whose robots drive faulty
tours and healthy ones over ramps. Residuals are kept in DIR, and what contacts and the body show is
found once for all rules that do not change it. Without names all rules of the window and of the
states are left out, one after the other, and the parts of the classifier beside them. A row tells
what is right without it: a rule that changes nothing on drives it was not chosen on is not needed.
"""

import argparse
import json
import pickle
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

from attrs import frozen
from commissioned import FAULTY, HEALTHY, IMU_TOPIC, commissioned_kind, file_of, seed_of, tour
from diagnosis import codes_of, rebanded, score_faulty, score_healthy, twin_of
from diagnosis_report import Outcome, report
from extended import Fleet, scenario_of, seeds_of, targets, tracked
from faults.drawn import KINDS
from faults.play import changes_of
from faults.recordings import Recordings
from pool import each
from ramps import over_ramps
from rich.console import Console
from rich.table import Table
from stages import frames_of, pipeline_of

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_fault_diag.classifier.contacts import Contacts
from tomr_fault_diag.classifier.judges import WindowJudge
from tomr_fault_diag.classifier.lasting import LastingWatch
from tomr_fault_diag.classifier.misfit import MisfitWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.outside import Outside, OutsideWatch
from tomr_fault_diag.classifier.parity import ParityWatch
from tomr_fault_diag.classifier.rules import ALL_RULES, STATE_RULES, WINDOW_RULES
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.slides import SlideWatch
from tomr_fault_diag.classifier.slope import SlopeFilter
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.diagnosis.score import Seen as ExtendedSeen
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.robot import Robot, load_robot
from tomr_training.simulated_drive import simulated_drive

_FIRST_OTHER = 5_400_000  # seed
ALL = "all rules"
SLIDES, OUTSIDE, SLOPE = "particles", "what acts on the body", "slopes taken out"
LASTING, PARITY = "the watch for small faults", "all that parity says"
PARTS = (SLIDES, OUTSIDE, SLOPE, LASTING, PARITY)
_SUMMARY = re.compile(
    r"SUMMARY drives right (\S+) \(extended (\S+)\), accuracy over time (\S+), "
    r"delay (\S+) s median (\S+) s p95, missed (\S+), false alarms (\S+)/h"
)


Said = Mapping[int, Diagnosis]  # by stamp [ns]


@frozen
class Seen:
    """Residuals of a drive, and who diagnoses them."""

    frames: Sequence[ResidualFrame]
    settings: ClassifierSettings
    robot: Robot


class _Kept:
    """What a watch found of each tick, found once."""

    def __init__(self, watch: SlideWatch | OutsideWatch, frames: Iterable[ResidualFrame]) -> None:
        self._found: Mapping[int, Contacts | Outside] = {
            frame.stamp_ns: watch.take(frame) for frame in frames
        }

    def clear(self) -> None:
        """Nothing to forget."""

    def take(self, frame: ResidualFrame) -> Contacts | Outside:
        """What was found."""
        return self._found[frame.stamp_ns]


@cache
def _network(weights: str) -> WindowNetwork:
    return WindowNetwork.load(weights)


def diagnosed(seen: Seen, names: Sequence[str]) -> dict[str, Said]:
    """What is said without each rule or part of these names."""
    robot, settings = seen.robot, seen.settings
    slides = cast(SlideWatch, _Kept(SlideWatch(robot), seen.frames))
    outside = cast(OutsideWatch, _Kept(OutsideWatch(robot), seen.frames))
    found: dict[str, Said] = {}
    for name in names:
        rules = ALL_RULES if name in (ALL, *PARTS) else ALL_RULES.without(name)
        small = settings.small_faults and name != LASTING
        classifier = FaultClassifier(
            WindowJudge(_network(settings.weights), settings, rules),
            slides=None if name == SLIDES else slides,
            outside=None if name == OUTSIDE else outside,
            slope=None if name == SLOPE else SlopeFilter(robot),
            lasting=LastingWatch(robot) if small else None,
            misfits=MisfitWatch(Motors(robot).idle.tolist(), BrakingWatch(robot)),
            parity=None if name == PARITY else ParityWatch(robot),
        )
        said = (classifier.classify(frame) for frame in seen.frames)
        found[name] = {one.stamp_ns: one for one in said if one is not None}
    return found


def _at(said: Said, frame: ResidualFrame) -> Diagnosis | None:
    return said.get(frame.stamp_ns)


def kept(keep: Path, robot: Path, name: str, make: Callable[[], Any]) -> Any:
    """What is kept of a drive of the robot in a file, made where it is not there yet."""
    file = keep / f"{sha256(robot.read_bytes()).hexdigest()[:12]}_{name}.pickle"
    if not file.exists():
        file.write_bytes(pickle.dumps(make()))
    return pickle.loads(file.read_bytes())


@frozen
class Practice:
    """A recording of `faults_practice` with a description of its robot."""

    bag: Path
    robot: Path

    def __call__(self, names: Sequence[str], keep: Path) -> dict[str, Any]:
        """Changes of the state as the score wants them."""
        settings = pipeline_of(self.robot).settings
        make = partial(frames_of, self.bag, self.robot, settings)
        frames = kept(keep, self.robot, self.bag.name, make)
        found = diagnosed(Seen(frames, settings.classifier, load_robot(self.robot)), names)
        return {name: changes_of(said.values()) for name, said in found.items()}


@frozen
class Tour:
    """A tour of a commissioned robot in MuJoCo."""

    folder: Path  # of all robots
    number: int
    index: int
    fault: str | None
    without: tuple[str, ...] = ()

    def __call__(self, names: Sequence[str], keep: Path) -> dict[str, Outcome]:
        """How it is diagnosed."""
        folder = self.folder / f"robot_{self.number}"
        seed = seed_of(self.number, (FAULTY if self.fault else HEALTHY) + self.index)
        chosen = tour(self.number, folder, seed, self.fault)
        chosen = chosen if self.fault else over_ramps(chosen)
        kind, robot = commissioned_kind(folder)
        source = file_of(folder)
        labelled = kept(keep, source, f"{seed}", partial(simulated_drive, chosen, self.without))
        twin = None
        if self.fault:
            twin = kept(keep, source, f"{seed}_twin", partial(twin_of, chosen, labelled))
        seen = Seen(rebanded(labelled.frames, kind.bands), kind.settings, robot)
        outcomes = {}
        for name, said in diagnosed(seen, names).items():
            named = codes_of(seen.frames, partial(_at, said))
            outcomes[name] = (
                score_healthy(labelled, named)
                if twin is None
                else score_faulty(chosen, labelled, twin, named)
            )
        return outcomes


@frozen
class Other:
    """A drive of bench/extended.py: a fault beyond the six, or pushes where it has no name."""

    fleet: Fleet
    seed: int
    name: str

    def __call__(self, names: Sequence[str], keep: Path) -> dict[str, ExtendedSeen | None]:
        """What was said of it; None where its fault never shows."""
        source = file_of(self.fleet.folder(self.seed))
        make = partial(scenario_of, self.fleet, self.seed, self.name)
        case = kept(keep, source, f"{self.seed}_other", make)
        if case is None:
            return dict.fromkeys(names)
        kind, robot = self.fleet.kind(self.seed), self.fleet.drive(self.seed).believed
        frames = rebanded(case.labelled.frames, kind.bands)
        found = {}
        for name, said in diagnosed(Seen(frames, kind.settings, robot), names).items():
            found[name] = case.seen(tracked(frames, partial(_at, said)))
        return found


Work = Practice | Tour | Other


def _do(drive: Work, names: Sequence[str], keep: Path) -> dict[str, Any]:
    return drive(names, keep)


@frozen
class Ablation:
    """What is left out, and where residuals are kept."""

    names: Sequence[str]
    keep: Path

    def run(self, title: str, drives: Sequence[Work]) -> list[dict[str, Any]]:
        """What each drive is worth, by name."""
        return each(partial(_do, names=self.names, keep=self.keep), drives, title=title)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.0%}"


def practice(ablation: Ablation, robot: Path) -> Table:
    """The recordings of `faults_practice` without each of the names."""
    recordings = Recordings.find()
    drives = (*recordings.drives("drives"), *recordings.drives("healthy_long"))
    found = ablation.run(str(robot), [Practice(drive.bag, robot) for drive in drives])
    head = ("right", "other", "of the time", "delay", "95 %", "missed", "false/h")
    table = Table("without", *head, title=str(robot))
    for name in ablation.names:
        out = ablation.keep / "scored"
        folder = out / recordings.robot
        folder.mkdir(parents=True, exist_ok=True)
        for drive, said in zip(drives, found, strict=True):
            text = json.dumps(said[name]) + "\n"
            (folder / f"{drive.identity}.json").write_text(text, encoding="utf-8")
        command = [sys.executable, *map(str, (recordings.scorer, out, recordings.truth))]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        summary = _SUMMARY.search(done.stdout)
        table.add_row(name, *(summary.groups() if summary else ("?",) * len(head)))
    return table


def tours(
    ablation: Ablation, folder: Path, counts: tuple[int, int], without: tuple[str, ...]
) -> Table:
    """Commissioned robots without each of the names; `counts` of faulty and healthy tours each."""
    numbers = sorted(int(path.name.removeprefix("robot_")) for path in folder.glob("robot_*"))

    def several(fault: str | None, count: int) -> list[Tour]:
        return [
            Tour(folder, number, index, fault, without)
            for number in numbers
            for index in range(count)
        ]

    sick = ablation.run(f"{folder}, faulty", several("fault", counts[0]))
    well = ablation.run(f"{folder}, over ramps", several(None, counts[1]))
    title = f"{folder}, robots {', '.join(map(str, numbers))}"
    table = Table("without", "right", "delay", "95 %", "never", "false", "h", title=title)
    for name in ablation.names:
        found: Any = report([item[name] for item in sick], [item[name] for item in well])
        delay, alarms = found["delay_s"]["all"], found["false_alarms"]
        never = f"{delay['never_named']} of {delay['onsets']}"
        right = f"{found['observable_faults']['right']:.2%}"
        cells = (right, delay["median"], delay["p95"], never, alarms["count"], alarms["hours"])
        table.add_row(name, *map(str, cells))
    return table


def others(
    ablation: Ablation, folder: Path, counts: tuple[int, int], without: tuple[str, ...]
) -> Table:
    """The same of faults beyond the six; `counts` of drives of each kind, and of pushed ones."""
    fleet = Fleet.of(folder, without)
    drives = [
        Other(fleet, seed, name) for seed, name in seeds_of(_FIRST_OTHER, *counts, list(KINDS))
    ]
    found = ablation.run(f"{folder}, others", drives)
    head = ("known kinds", "wrong", "unknown kinds", "wrong", "alarms, pushed")
    table = Table("without", *head, title=str(folder))
    for name in ablation.names:
        shown = [item[name] for item in found if item[name] is not None]
        groups: Any = targets(shown)
        cells = [
            _percent(groups[group][key]["share"])
            for group, key in (
                ("extended states", "right"),
                ("extended states", "a wrong fault"),
                ("unknown kinds", "unknown or a fault"),
                ("unknown kinds", "a wrong fault"),
            )
        ]
        pushed = [item for drive, item in zip(drives, found, strict=True) if not drive.name]
        alarms = sum(len(item[name].alarms) for item in pushed)
        table.add_row(name, *cells, str(alarms))
    return table


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    known = [ALL, *WINDOW_RULES, *STATE_RULES, *PARTS]
    several: dict[str, Any] = {"type": Path, "nargs": "+", "default": [], "metavar": "DIR"}
    parser.add_argument("--keep", type=Path, required=True, metavar="DIR", help="residuals")
    parser.add_argument("--practice", **{**several, "metavar": "ROBOT"}, help="descriptions")
    parser.add_argument("--commissioned", **several, help="robots with an IMU")
    parser.add_argument("--without-imu", **several, help="robots that have none")
    parser.add_argument("--only", nargs="+", default=known, choices=known, metavar="NAME")
    parser.add_argument("--faulty", type=int, default=24, help="tours of each robot (default 24)")
    parser.add_argument("--healthy", type=int, default=60, help="tours of each robot (default 60)")
    parser.add_argument("--others", type=int, default=0, help="of each kind of others (default 0)")
    parser.add_argument("--pushed", type=int, default=0, help="healthy and pushed (default 0)")
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    console, ablation = Console(width=110), Ablation(options.only, options.keep)
    for robot in options.practice:
        console.print(practice(ablation, robot))
    fleets: list[tuple[Path, tuple[str, ...]]] = [(folder, ()) for folder in options.commissioned]
    fleets += [(folder, (IMU_TOPIC,)) for folder in options.without_imu]
    for folder, without in fleets:
        if options.faulty or options.healthy:
            counts = (options.faulty, options.healthy)
            console.print(tours(ablation, folder, counts, without))
        if options.others or options.pushed:
            counts = (options.others, options.pushed)
            console.print(others(ablation, folder, counts, without))
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
