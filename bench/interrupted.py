"""Healthy and faulty drives in which data are missing or bad: nothing may be concluded from that.

    .venv/bin/python bench/interrupted.py [--placements 24] [--seeds 2] [--first-seed 100]
        [--only WORD] [--json OUT]

Drives in MuJoCo with the reference robot, in whose recordings streams pause, stamps leap and
scatter, samples are lost, sensors die, freeze or send what no sensor measures, whose angles begin
anew each turn, and that obeyed other commands than were recorded: late ones, another's, or none
that came. Counted are the drives in which a fault is named that the undisturbed drive does
not name, and, of faulty drives, those in which the fault is not named (again) within 2 s of what it
needs being back.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from disturbances import (
    FROZEN_SENSOR,
    IMU,
    REPEATING_GYRO,
    REPEATING_IMU,
    START_NS,
    STREAMS,
    Change,
    Drive,
    Item,
    absurd,
    begun_anew_each_turn,
    both,
    dead,
    disobeyed,
    inertial,
    leap,
    loss,
    pause,
    power,
    scatter,
    unplugged,
    unseen,
    zeros_of_imu,
)
from pool import each
from winding import winding

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import DISOBEYS, FAULTLESS, POWER_SENSOR, State
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.drive import drive, start_mission
from tomr_sim_bridge.missions.mission import load_mission

_AGAIN = 2.0  # s in which a fault must be named again
WINDING = "winding"  # no mission: see there
FAULTY = ("circle_encoder_lost", "circle_control_signal_lost", "square_encoder_lost")
_LATEST = 26.0  # s of a drive that is played


@cache
def recorded(mission: str, seed: int, has_imu: bool = False) -> Drive:
    """A mission of the simulated reference robot, or a winding drive."""
    robot, topics = shipped_robot("reference"), {*STREAMS["all"], *([IMU] if has_imu else [])}
    plan = load_mission("random_tour" if mission == WINDING else mission)
    simulation = start_mission(plan, robot, seed, START_NS)
    if mission == WINDING:
        driven = winding(simulation, seed, _LATEST)
    else:
        driven = drive(plan, simulation, seed)
    return tuple(
        Item(sample.stamp_ns, sample.topic, to_bag(sample.message))
        for samples in driven
        for sample in samples
        if sample.topic in topics and sample.stamp_ns < START_NS + to_ns(_LATEST)
    )


@frozen
class Case:
    """A disturbance of a drive, when what it takes away is back [s], and the seed of its chance.

    `true`: the state that it brings about, which may be said. `has_imu`: whether the robot has one.
    """

    kind: str
    change: Change
    back: float = 0.0
    seed: int = 0
    true: State | None = None
    has_imu: bool = False

    def played(self, mission: str, seed: int) -> list[Diagnosis]:
        """What is published of a drive with the disturbance."""
        items = recorded(mission, seed, self.has_imu)
        return states(self.change(items, np.random.default_rng(self.seed)))


def gaps(places: Sequence[float]) -> Iterator[Case]:
    """Pauses and leaps at some times [s]."""
    for streams in STREAMS:
        for length in (0.2, 0.3, 0.5, 1.5):
            for at in places:
                yield Case(f"pause {length} s, {streams}", pause(streams, at, length), at + length)
    for by in (0.3, -0.3):
        for at in places:
            yield Case(f"stamps leap {by:+} s", leap(at, by), at + abs(by))


def cases(placements: int) -> Iterator[Case]:
    """All disturbances, those in one place at many."""
    places = np.linspace(2.0, 20.0, placements).tolist()
    yield from gaps(places)
    yield from of_imu(places[::3])
    yield Case("angles begin anew each turn", begun_anew_each_turn())
    for seed in range(placements // 2):
        for share in (0.02, 0.2, 0.5, 0.67, 0.9):
            yield Case(f"{share:.0%} lost", loss(share), seed=seed)
        for std in (0.002, 0.005, 0.01):
            yield Case(f"stamps scatter {1e3 * std:g} ms", scatter(std), seed=seed)
        worn = both(loss(0.02), scatter(0.005), pause("motors", 4.0 + 2 * seed, 1.0))
        yield Case("2 % lost, 5 ms, 1 s without power", worn, seed=seed)
    for at in places[::3]:
        for wheel in range(3):
            yield Case("power frozen", power(wheel, at, FROZEN_SENSOR), true=POWER_SENSOR[wheel])
            yield Case("power reads zero", power(wheel, at, dead), true=POWER_SENSOR[wheel])
            yield Case("one sample of 1e30 V", power(wheel, at, absurd, 0.015))
            yield Case("1e30 V for good", power(wheel, at, absurd), true=POWER_SENSOR[wheel])
            yield Case("unplugged", unplugged(wheel, at), true=POWER_SENSOR[wheel])


def of_imu(places: Sequence[float]) -> Iterator[Case]:
    """An IMU that dies at some times [s]."""
    kinds = {
        "IMU repeats itself": REPEATING_IMU,
        "gyro repeats itself": REPEATING_GYRO,
        "IMU reads zero": zeros_of_imu,
    }
    for kind, make in kinds.items():
        for at in places:
            yield Case(kind, inertial(at, make), has_imu=True)


def disobedience(mission: str, places: Sequence[float]) -> Iterator[Case]:
    """Commands of a drive that are not obeyed in time, at some times [s]."""
    for length in (0.1, 0.2, 0.3, 0.4):
        for at in places:
            kind = f"{length} s of other commands, {mission}"
            yield Case(kind, disobeyed(at, length), at + length, true=DISOBEYS)


def strangers(mission: str, places: Sequence[float]) -> Iterator[Case]:
    """Commands of another, from some times on [s], while the robot is told to rest, or nothing."""
    for is_silent in (False, True):
        kind = f"another commands, {'silence' if is_silent else 'rest'} here, {mission}"
        for at in places:
            yield Case(kind, unseen(at, 3.0, is_silent), at + 3.0, true=DISOBEYS)


def states(items: Drive) -> list[Diagnosis]:
    """What is published of a drive."""
    pipeline = Pipeline(shipped_robot("reference"), DiagnosisSettings.of({}, "defaults"))
    return [
        diagnosis
        for item in items
        for diagnosis in pipeline.take(item.topic, item.message, item.stamp_ns).diagnoses
    ]


def accused(found: Sequence[Diagnosis], true: State | None = None) -> list[str]:
    """Faults in the order in which they were named, but for one that is there."""
    names = [d.state.name for d in found if d.changed and d.state != true]
    return [name for name in names if name not in FAULTLESS]


def healthy(case: Case, mission: str, seed: int) -> tuple[str, list[str], float]:
    """The kind of a case, what it made to be named, and the share of time that was decided."""
    found = case.played(mission, seed)
    periodic = [d for d in found if not d.changed]
    decided = [d for d in periodic if d.state.name == "normal" or d.state.name not in FAULTLESS]
    return case.kind, accused(found, case.true), len(decided) / max(len(periodic), 1)


def faulty(case: Case, mission: str, seed: int) -> tuple[str, list[str], float]:
    """As `healthy` of a drive with a fault: what became of the fault's name, if not what should."""
    usual = usually(mission, seed)
    found = case.played(mission, seed)
    wrong = [f"{name} for {usual}" for name in accused(found) if name != usual]
    first, last = fault_times(mission)
    until = max(case.back, first) + _AGAIN
    named = [d.state.name for d in found if d.stamp_ns <= START_NS + to_ns(until)]
    if until < last and named[-1] != usual:
        wrong.append(f"{usual} not found again")
    inside = [d.state.name for d in found if first < 1e-9 * (d.stamp_ns - START_NS) < last]
    after = inside[inside.index(usual) :] if usual in inside else []
    if any(name != usual for name in after):
        wrong.append(f"{usual} cleared")
    return f"faulty: {case.kind}", wrong, 1.0


@cache
def usually(mission: str, seed: int) -> str:
    """The fault that is named where nothing is disturbed."""
    return (accused(states(recorded(mission, seed))) or ["nothing"])[0]


def fault_times(mission: str) -> tuple[float, float]:
    """When the fault of a mission begins and ends [s]."""
    (fault,) = load_mission(mission).faults
    return fault.start, fault.end or _LATEST


def table(results: Sequence[tuple[str, list[str], float]]) -> dict[str, dict[str, Any]]:
    """Drives, accusations and shares decided by kind."""
    found: dict[str, dict[str, Any]] = {}
    for kind, names, decided in results:
        row = found.setdefault(kind, {"drives": 0, "wrong": 0, "decided": [], "names": {}})
        row["drives"] += 1
        row["wrong"] += bool(names)
        row["decided"].append(decided)
        for name in names:
            row["names"][name] = row["names"].get(name, 0) + 1
    for row in found.values():
        row["decided"] = round(float(np.mean(row["decided"])), 3)
    return found


Play = tuple[Callable[[Case, str, int], tuple[str, list[str], float]], Case, str, int]


def plays(placements: int, seeds: Iterable[int]) -> Iterator[Play]:
    """All drives to play: healthy ones, and those with a fault."""
    for seed in seeds:
        for mission in ("random_tour", WINDING):
            for case in cases(placements):
                yield healthy, case, mission, seed
        for mission in ("random_tour", "circle", WINDING):
            where = np.linspace(3.0, 21.0, placements).tolist()
            for case in chain(disobedience(mission, where), strangers(mission, where)):
                yield healthy, case, mission, seed
        for mission in FAULTY:
            first, _ = fault_times(mission)
            places = [first - 0.2, first + 1.0, first + 1.7]
            for case in chain(gaps(places), disobedience(mission, places)):
                yield faulty, case, mission, seed


def _play(index: int, placements: int, seeds: Iterable[int]) -> tuple[str, list[str], float]:
    judge, case, mission, seed = next(islice(plays(placements, seeds), index, None))
    return judge(case, mission, seed)


def main(arguments: Sequence[str] | None) -> int:
    """Play all cases; a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--placements", type=int, default=24)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--only", default="", help="cases whose kind holds this word")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--jobs", type=int, help="processes (default: one a core)")
    options = parser.parse_args(arguments)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    amount = options.placements, seeds
    listed = list(plays(*amount))
    chosen = [k for k, (_, case, *_) in enumerate(listed) if options.only in case.kind]
    for mission, seed in sorted({(listed[k][2], listed[k][3]) for k in chosen}):
        usually(mission, seed)  # the workers inherit it, and the drive
    play = partial(_play, placements=amount[0], seeds=amount[1])
    results = each(play, chosen, jobs=options.jobs)
    found = table(results)
    for kind, row in found.items():
        print(f"{kind:40} {row['wrong']:3} of {row['drives']:3} wrong, "
              f"{row['decided']:.0%} decided  {row['names'] or ''}")  # fmt: skip
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(main))
