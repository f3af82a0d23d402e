"""Faults beyond the paper's in MuJoCo, kinds that nobody knows, and pushes, scored with intervals.

    .venv/bin/python bench/extended.py [--drives 20] [--healthy-hours 0.5] [--json report.json]
        [--commissioned DIR [--without-imu]]

So many drives of each kind of fault in docs/faults.md, and of slippery floors on which the robot
tows something: robots, deviations of 5 % from their
description, payloads, floors, bumps, missions and sensor noise as in bench/diagnosis.py, wheels,
sizes and onsets at random, from seeds that nothing else uses. Healthy drives are shoved (up to
3 N/kg for 0.2 s) and leaned on (up to 1 N/kg for seconds) as well. With --commissioned the robots
are those that bench/commissioned.py --out DIR has commissioned, with their commissioned.yaml; and
their drives without an IMU with --without-imu.

A fault counts while it shows: power or speeds differ measurably from those of a twin of the same
robot in the same drive without the fault (`tomr_training/labels.py`); one of a power sensor, while
its wheel turns. Decisions count from 1 s after it first shows. Figures are those of
`tomr_diagnose --labels`. Four drives take about a minute of one core.
"""

import argparse
import math
import os
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Self

import numpy as np
from attrs import evolve, frozen
from commissioned import IMU_TOPIC, commissioned_kind, tour
from diagnosis import Kind as Diagnosed
from diagnosis import rebanded, twin_of
from diagnosis_report import publish
from tqdm import tqdm

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
from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.faults import check_settings
from tomr_sim_bridge.missions.schema import PlannedFault
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

Random = np.random.Generator
Sized = tuple[dict[str, object], float]  # settings at severity 1, and the size to be scored by


EXTENDED = "extended states"
NOT_TRAINED = "unknown kinds"
LOADED_SLIP = "slip under a load"  # one of the paper's six, and no other state is right


@frozen
class Kind:
    """A fault to draw: its settings and the size by which it is scored."""

    fault_id: str
    draw: Callable[[Random, Robot], Sized]
    group: str = EXTENDED
    also: str = ""  # a second fault, of another kind, at once
    draw_also: Callable[[Random, Robot], Sized] = lambda random, robot: ({"severity": 0.8}, 0.8)


def _plain(random: Random, robot: Robot) -> Sized:
    return {}, 1.0


def _uniform(setting: str, low: float, high: float) -> Callable[[Random, Robot], Sized]:
    def draw(random: Random, robot: Robot) -> Sized:
        value = float(random.uniform(low, high))
        return {setting: value}, value

    return draw


def _drag(random: Random, robot: Robot) -> Sized:
    """In parts of the wheel's own dry friction."""
    own = robot.everywhere("friction.coulomb", "torque", 0.0)[0]
    share = float(random.uniform(0.3, 6.0))
    return {"torque": share * own}, share


def _scale(random: Random, robot: Robot) -> Sized:
    off = float(random.uniform(0.15, 0.7))
    return {"factor": 1.0 + off * float(random.choice([-1.0, 1.0]))}, off


def _bias(random: Random, robot: Robot) -> Sized:
    off = float(random.uniform(0.5, 6.0))
    return {"bias": off * float(random.choice([-1.0, 1.0]))}, off


def _towed(random: Random, robot: Robot) -> Sized:
    share = float(random.uniform(0.4, 1.5))  # N/kg
    return {"drag": share * robot.mass}, share


def _slippery(random: Random, robot: Robot) -> Sized:
    severity = float(random.uniform(0.5, 0.85))  # of traction 0.02 to 0.14 is left
    return {"severity": severity}, severity


def _hindered(random: Random, robot: Robot) -> Sized:
    share = float(random.uniform(0.15, 0.6))  # N/kg
    return {"drag": share * robot.mass}, share


def _wind(random: Random, robot: Robot) -> Sized:
    speed = float(random.uniform(8.0, 16.0))
    return {"speed": speed, "azimuth": float(random.uniform(-math.pi, math.pi))}, speed


KINDS: Mapping[str, Kind] = {
    kind.fault_id + ("" if not kind.also else f" and {kind.also}"): kind
    for kind in (
        Kind("drivers_off", _plain),
        Kind("commands_ignored", _plain),
        Kind("wheel_stuck", _plain),
        Kind("bearing_dragging", _drag),
        Kind("motor_resistance_high", _uniform("rise", 0.1, 2.0)),
        Kind("motor_torque_weak", _uniform("loss", 0.1, 0.6)),
        Kind("power_sensor_dead", _plain),
        Kind("power_sensor_frozen", _plain),
        Kind("power_sensor_scaled", _scale),
        Kind("power_sensor_biased", _bias),
        Kind("supply_low", _uniform("undervoltage", 2.0, 8.0)),
        Kind("control_signal_lost", _plain, also="floor_slippery"),
        Kind("load_towed", _towed, NOT_TRAINED),
        Kind("tethered", _uniform("stiffness", 10.0, 40.0), NOT_TRAINED),
        Kind("windy", _wind, NOT_TRAINED),
        Kind("floor_slippery", _slippery, LOADED_SLIP, "load_towed", _hindered),
    )
}


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


def faulty_drive(drive: Drive, name: str) -> tuple[Drive, float]:
    """A drive with a fault of a kind in it, and the size of the fault."""
    kind, seed = KINDS[name], drive.seed
    random = np.random.default_rng([seed, 1])
    settings, size = kind.draw(random, drive.plant)
    start = float(random.uniform(0.2, 0.5) * drive.length)
    end = float(random.uniform(0.7, 1.0) * drive.length)
    wheel = int(random.integers(1, 4))
    faults = [_planned(kind.fault_id, start, end, wheel, settings)]
    if kind.also:
        faults.append(
            _planned(kind.also, start, end, wheel, kind.draw_also(random, drive.plant)[0])
        )
    return evolve(drive, mission=evolve(drive.mission, faults=tuple(faults))), size


def _planned(
    fault_id: str, start: float, end: float, wheel: int, given: Mapping[str, object]
) -> PlannedFault:
    settings = {"severity": 1.0, **given}
    if "wheel" in check_settings(fault_id, {}, fault_id):
        settings["wheel"] = wheel
    return PlannedFault(fault_id, start, end, check_settings(fault_id, settings, fault_id))


def pushed_drive(drive: Drive) -> Drive:
    """A healthy drive with two shoves and a lean, beside the bumps that all drives have."""
    random = np.random.default_rng([drive.seed, 2])
    begins = np.sort(random.uniform(1.0, drive.length - 1.0, 3))
    pushes = []
    for begin, until in pairwise([*begins, drive.length]):
        is_lean = random.random() < 0.3
        length = min(random.uniform(2.0, 6.0) if is_lean else 0.2, until - begin)
        if length <= 0.0:
            continue
        settings = {
            "force": float(random.uniform(0.3, 1.0) if is_lean else random.uniform(0.5, 3.0)),
            "azimuth": float(random.uniform(-math.pi, math.pi)),
            "lever": float(random.uniform(-0.5, 0.5) * drive.plant.robot_radius),
            "rise": length / 2.0 if is_lean else 0.0,
        }
        pushes.append(_planned("pushed", float(begin), float(begin + length), 1, settings))
    return evolve(drive, mission=evolve(drive.mission, faults=tuple(pushes)))


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
    groups: dict[str, Counter[str]] = {
        name: Counter() for name in (EXTENDED, NOT_TRAINED, LOADED_SLIP)
    }
    for case in (case for item in found for case in item.cases):
        groups[KINDS[case.kind].group][
            case.verdicts.most_common(1)[0][0] if case.verdicts else MISSED
        ] += 1
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
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--json", type=Path, help="write the report to this file as well")
    options = parser.parse_args(arguments)
    fleet = Fleet.of(options.commissioned, (IMU_TOPIC,) if options.without_imu else ())
    healthy = round(options.healthy_hours * 3600.0 / _DRIVE_SECONDS)
    seeds = seeds_of(options.first_seed, options.drives, healthy, options.kinds)
    tasks = [(fleet, seed, name) for seed, name in seeds]
    with ProcessPoolExecutor(options.jobs) as pool:
        played = pool.map(scored, tasks)
        found = list(tqdm(played, total=len(tasks), unit="drive", disable=None))
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
