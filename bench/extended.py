"""Faults beyond the paper's in MuJoCo, kinds that nobody knows, and pushes, scored with intervals.

    .venv/bin/python bench/extended.py [--drives 20] [--healthy-hours 0.5] [--json report.json]
        [--commissioned DIR [--without-imu]]

So many drives of each kind of fault in docs/faults.md, and of slippery floors on which the robot
tows something: robots, deviations of 5 % from their description, payloads, floors, bumps, missions
and sensor noise as in bench/diagnosis.py, wheels, sizes and onsets at random, from seeds that
nothing else uses. Healthy drives are shoved (up to 3 N/kg for 0.2 s) and leaned on (up to 1 N/kg
for seconds) as well. With --commissioned the robots are those that bench/commissioned.py --out DIR
has commissioned, with their commissioned.yaml; and their drives without an IMU with --without-imu.

A fault counts while it shows: power or speeds differ measurably from those of a twin of the same
robot in the same drive without the fault (`tomr_training/labels.py`); one of a power sensor, while
its wheel turns. Decisions count from 1 s after it first shows. Figures are those of
`tomr_diagnose --labels`. Four drives take about a minute of one core.
"""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

import numpy as np
from attrs import evolve, frozen
from commissioned import IMU_TOPIC, commissioned_kind, tour
from diagnosis import Kind as Diagnosed
from diagnosis import rebanded, twin_of
from diagnosis_report import publish
from faults.drawn import EXTENDED, KINDS, LOADED_SLIP, NOT_TRAINED, faulty_drive, pushed_drive
from pool import each

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.diagnosis.labels import Label, simulated
from tomr_fault_diag.diagnosis.score import (
    MISSED,
    RIGHT,
    WRONG,
    Scores,
    Seen,
    seen,
    with_interval,
)
from tomr_fault_diag.diagnosis.track import Track, Tracker
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.cli import run_main
from tomr_power_model.errors import InputError
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import Drive, random_drive
from tomr_training.labels import SLIPPING, Flags, GroundTruth, Noise, deviates, lasting
from tomr_training.simulated_drive import (
    PERIOD_NS,
    START_NS,
    LabelledDrive,
    simulated_drive,
)

FIRST_SEED = 3_000_000  # of faulty drives; healthy ones follow a million later
_HEALTHY = 1_000_000
_PERIOD = PERIOD_NS * 1e-9  # s
_DRIVE_SECONDS = 18.0  # mean length of a drive, at least
_TURNING = 0.5  # rad/s: a slower wheel may hide what its power sensor does
_JOINED = 1.0  # s between two shows that make one


@frozen
class Fleet:
    """Whose drives are scored: robots at random, or those commissioned in the folders of DIR."""

    robots: tuple[Path, ...] = ()
    without: tuple[str, ...] = ()  # topics

    @classmethod
    def of(cls, commissioned: Path | None, without: tuple[str, ...] = ()) -> Self:
        """Raises InputError for a folder that holds no commissioned robot."""
        if commissioned is None:
            return cls(without=without)
        found = sorted(commissioned.glob("robot_*"), key=_number)
        if not found:
            raise InputError(f"{commissioned}: no robot_*; run bench/commissioned.py --out there")
        return cls(tuple(found), without)

    def drive(self, seed: int) -> Drive:
        """A healthy drive that depends on nothing but the seed and the robots."""
        if not self.robots:
            return random_drive(shipped_robot("reference"), seed, None)
        folder = self.folder(seed)
        return tour(_number(folder), folder, seed, None)

    def kind(self, seed: int) -> Diagnosed:
        """The classifier of the robot of that drive."""
        if not self.robots:
            return Diagnosed(ClassifierSettings(), BandSettings())
        return commissioned_kind(self.folder(seed))[0]

    def folder(self, seed: int) -> Path:
        """Of the commissioned robot of that drive."""
        return self.robots[seed % len(self.robots)]


def _number(folder: Path) -> int:
    return int(folder.name.removeprefix("robot_"))


@frozen
class Scenario:
    """A drive as it was simulated, and what is wrong in it."""

    labelled: LabelledDrive
    labels: tuple[Label, ...] = ()

    def seen(self, track: Track) -> Seen:
        """What was said of it against its labels."""
        return seen(track, START_NS, self.labels, (0, 1))


def tracked(
    frames: Sequence[ResidualFrame], classify: Callable[[ResidualFrame], Diagnosis | None]
) -> Track:
    """What is said of each tick."""
    tracker = Tracker(False)
    for frame in frames:
        diagnosis = classify(frame)
        if diagnosis is not None:
            tracker.diagnosis(diagnosis, math.nan)
        tracker.frame(frame)
    return tracker.track()


def shows(drive: Drive, labelled: LabelledDrive, twin: GroundTruth) -> Flags:
    """Ticks in which the fault can be seen, (n,)."""
    fault = drive.mission.faults[0]
    if fault.fault_id.startswith("power_sensor"):
        wheel = int(str(fault.settings["wheel"])) - 1
        seen_now = np.abs(twin.speed[:, wheel]) > _TURNING
    else:
        seen_now = deviates(labelled.truth, twin, Noise.of(drive.plant))
        if fault.fault_id == "floor_slippery":
            seen_now &= labelled.truth.slip.max(axis=1) > SLIPPING
    return lasting(np.asarray(seen_now & labelled.faulty))


def spans(flags: Flags, first: int) -> tuple[tuple[float, float], ...]:
    """Times [s] of runs of ticks, the first of which is `first`; short gaps are closed."""
    ticks = np.flatnonzero(flags)
    if not len(ticks):
        return ()
    cuts = np.flatnonzero(np.diff(ticks) * _PERIOD > _JOINED)
    starts, ends = [ticks[0], *ticks[cuts + 1]], [*ticks[cuts], ticks[-1]]
    return tuple(
        (float(first + a) * _PERIOD, float(first + b + 1) * _PERIOD)
        for a, b in zip(starts, ends, strict=True)
    )


def faulty(fleet: Fleet, seed: int, name: str) -> Scenario | None:
    """A faulty drive and its label; None where the fault never shows."""
    drive, size = faulty_drive(fleet.drive(seed), name)
    labelled = simulated_drive(drive, fleet.without)
    observable = spans(shows(drive, labelled, twin_of(drive, labelled)), labelled.first)
    if not observable:
        return None
    label = _label(drive, name, size)
    # The onset is when it first shows: what comes before, nobody need detect.
    onset = observable[0][0] - 4 * _PERIOD
    label = evolve(label, begun=label.onset, onset=onset, observable=observable)
    return Scenario(labelled, (label,))


def _label(drive: Drive, name: str, size: float) -> Label:
    first, *more = drive.mission.faults
    values = {"onset": first.start, "severity": size, "end": first.end or drive.length}
    if "wheel" in first.settings:
        values["wheel"] = float(str(first.settings["wheel"]))
    label = evolve(simulated(name, first.fault_id, values), kind=name)
    if KINDS[name].group == LOADED_SLIP:
        return label
    others = [simulated(name, fault.fault_id, {}).state for fault in more]
    return evolve(label, accept=(*label.accept, *others, *(["unknown"] if more else [])))


def pushed(fleet: Fleet, seed: int) -> Scenario:
    """A healthy drive with pushes: whatever is named is an alarm."""
    drive = pushed_drive(fleet.drive(seed))
    return Scenario(simulated_drive(drive, fleet.without))


def scenario_of(fleet: Fleet, seed: int, name: str) -> Scenario | None:
    """Of a kind of fault, or healthy and pushed where there is no name."""
    return faulty(fleet, seed, name) if name else pushed(fleet, seed)


def seeds_of(first: int, drives: int, healthy: int, kinds: Sequence[str]) -> list[tuple[int, str]]:
    """Seeds and kinds of so many drives of each, and of healthy ones."""
    places = {name: number for number, name in enumerate(KINDS)}
    faulty = [(first + 1000 * places[name] + k, name) for name in kinds for k in range(drives)]
    return [*faulty, *((first + _HEALTHY + k, "") for k in range(healthy))]


def scored(task: tuple[Fleet, int, str]) -> Seen | None:
    """One drive; None where its fault never shows."""
    fleet, seed, name = task
    case = scenario_of(fleet, seed, name)
    if case is None:
        return None
    kind = fleet.kind(seed)
    classifier = FaultClassifier.of(kind.settings, fleet.drive(seed).believed)
    frames = rebanded(case.labelled.frames, kind.bands)
    return case.seen(tracked(frames, classifier.classify))


def targets(found: Sequence[Seen]) -> dict[str, object]:
    """What each group of faults was called for most of the time, with exact intervals."""
    names = EXTENDED, NOT_TRAINED, LOADED_SLIP
    groups: dict[str, Counter[str]] = {name: Counter() for name in names}
    for case in (case for item in found for case in item.cases):
        most = case.verdicts.most_common(1)[0][0] if case.verdicts else MISSED
        groups[KINDS[case.kind].group][most] += 1
    report: dict[str, object] = {}
    for name, counts in groups.items():
        total = counts.total()
        judged = {
            "right": counts[RIGHT],
            "right or unknown": total - counts[WRONG] - counts[MISSED],
            "unknown or a fault": total - counts[MISSED],
            "a wrong fault": counts[WRONG],
        }
        report[name] = {"faults": total} | {
            words: with_interval(part, total) for words, part in judged.items()
        }
    return report


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=20, help="of each kind (default 20)")
    parser.add_argument("--healthy-hours", type=float, default=0.5, help="(default 0.5)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the test set")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--commissioned", type=Path, help="DIR of bench/commissioned.py --out")
    parser.add_argument("--without-imu", action="store_true", help="robots that have none")
    parser.add_argument("--jobs", type=int, help="processes (default: one a core)")
    parser.add_argument("--json", type=Path, help="write the report to this file as well")
    options = parser.parse_args(arguments)
    fleet = Fleet.of(options.commissioned, (IMU_TOPIC,) if options.without_imu else ())
    healthy = round(options.healthy_hours * 3600.0 / _DRIVE_SECONDS)
    seeds = seeds_of(options.first_seed, options.drives, healthy, options.kinds)
    tasks = [(fleet, seed, name) for seed, name in seeds]
    found = each(scored, tasks, jobs=options.jobs)
    shown = [item for item in found if item is not None]
    report = {
        "never_showed": len(found) - len(shown),
        "targets": targets(shown),
        **Scores(tuple(shown)).as_dict(),
    }
    publish(report, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
