"""Commissioned robots in MuJoCo whose descriptions lack physics: false alarms, faults, delays.

    .venv/bin/python bench/commissioned.py --out DIR [--robots 0 1 2 3] [--hours 1] [--drives 96]
        [--ramps] [--without-imu] [--rates 50 10]

Each robot is drawn from three families, every value up to 5 % off its robot.yaml, which besides
lacks three effects of the vocabulary. It drives the plan of `tomr_commission` twice and a tour that
is held out, is commissioned on these, and then drives tours with payloads, floors and bumps as in
bench/diagnosis.py, healthy or with one of the six states' faults, of seeds that nothing else uses.
With --ramps the healthy tours lead over slopes of up to five degrees most of the time. Robots have
an IMU unless --without-imu is given, encoders at 100 Hz and power at 50 Hz unless --rates says
otherwise; each needs a DIR of its own. Scored as there, with commissioned.yaml. What is done is
kept in DIR and not done again.
"""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from time import process_time

import numpy as np
from attrs import evolve, frozen
from concealed.catalogue import ALL, SUPPLY, Case, Concealed
from concealed.concealing import hidden_of, real_parameters
from concealed.robots import described as described_robot
from concealed.robots import description_text
from diagnosis import Kind, named_by, rebanded, score_faulty, score_healthy, twin_of
from diagnosis_report import Outcome, publish, report
from pool import each
from ramps import over_ramps
from record import record_mission

from tomr_commission.cli import main as commission
from tomr_commission.plan import mission_text
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.cli import run_main
from tomr_power_model.robot import Robot, load_robot, read_node_sections, robot_from_parameters
from tomr_sim_bridge.missions import load_mission
from tomr_sim_bridge.missions.mission import parse_mission
from tomr_training.drives import Drive, another_drive, bumps, every_value
from tomr_training.simulated_drive import simulated_drive

_FIRST_SEED = 90_000_000
_ROBOT = 100_000  # seeds of one robot
FAULTY = 1000  # seeds of faulty drives follow so many later ...
HEALTHY = 50_000  # ... and those of healthy ones
_OFF = 0.05
_CONCEALED = 3
_HIDDEN = (
    Concealed("friction.stribeck", ALL, "small"),
    Concealed("friction.load_dependent", ALL, "medium"),
    Concealed("friction.asymmetric", ALL, "medium"),
    Concealed("electrical.switching_loss", ALL, "medium"),
    Concealed("electrical.regeneration_loss", ALL, "medium"),
    Concealed("electrical.winding_heating", ALL, "medium"),
    Concealed("electrical.supply_sag", SUPPLY, "medium"),
)
_TOP_SPEED = 0.6  # m/s
_DRIVE_SECONDS = 18.0  # mean length of a drive, at least
IMU_TOPIC = "imu/data"
_NODES = ("power_model", "power_residuals", "fault_classifier")
Rates = tuple[()] | tuple[float, float]  # of encoders and motor power [Hz]; empty: as usual


@frozen
class Made:
    """A robot as it really is, and the file that describes it."""

    real: Robot
    described: Path
    effects: tuple[str, ...]


def made(number: int, folder: Path, rates: Rates = ()) -> Made:
    """Robot `number`; but for what it measures how often, it depends on nothing else."""
    random = np.random.default_rng(seed_of(number, 0))
    drawn = random.choice(len(_HIDDEN), _CONCEALED, replace=False)
    case = Case(f"robot_{number}", "named", tuple(_HIDDEN[k] for k in drawn))
    _, nominal = described_robot(case, random)
    hidden = [hidden_of(item, nominal, random) for item in case.effects]
    real = robot_from_parameters(real_parameters(nominal, {}, hidden), case.name)
    folder.mkdir(parents=True, exist_ok=True)
    described = folder / "robot.yaml"
    described.write_text(description_text(case, nominal), encoding="utf-8")
    off = every_value(real, lambda value: float(value * random.uniform(1.0 - _OFF, 1.0 + _OFF)))
    if rates:
        encoder_rate, power_rate = rates
        sensors = evolve(off.sensors, encoder_rate=encoder_rate, power_rate=power_rate)
        off = evolve(off, sensors=sensors)
    return Made(off, described, tuple(item.effect for item in case.effects))


def commissioned(
    number: int, folder: Path, without: tuple[str, ...] = (), rates: Rates = ()
) -> dict[str, object]:
    """Record what a commissioning asks for, without some topics, and commission."""
    robot = made(number, folder, rates)
    believed = load_robot(robot.described)
    plan = parse_mission(mission_text(believed, _TOP_SPEED), "plan")
    mission = evolve(plan, stamp_jitter=0.0005, floor_friction=0.8)
    first = Drive(0, robot.real, believed, mission)
    seed = seed_of(number, 0)
    tours = [another_drive(first, seed + 10 + k).mission for k in range(4)]
    held = evolve(tours[0], phases=tuple(p for tour in tours for p in tour.phases), payload=0.0)
    drives = {
        "plan_1": mission,
        "plan_2": evolve(mission, floor_friction=0.7),
        "held_out": held,
    }
    bags = [folder / name for name in drives]
    for k, (bag, driven) in enumerate(zip(bags, drives.values(), strict=True), start=1):
        if not bag.exists():
            record_mission(driven, robot.real, seed + k, bag, without)
    out = folder / "commissioned"
    before = process_time()
    given = ["--robot", str(robot.described), "--out", str(out), "--quiet"]
    code = commission([*map(str, bags), *given])
    found = json.loads((out / "commission.json").read_text(encoding="utf-8"))
    return {
        "robot": number,
        "mass": believed.mass,
        "effects": robot.effects,
        "verdict": found["verdict"],
        "code": code,
        "reasons": [reason["what"] for reason in found["reasons"]],
        "caution": found["alarm"]["caution"],
        "margin": found["margin"],
        "cpu_s_of_one_process": round(process_time() - before),
    }


def file_of(folder: Path) -> Path:
    """What the commissioning of a robot wrote."""
    return folder / "commissioned" / "commissioned.yaml"


@cache
def commissioned_kind(folder: Path) -> tuple[Kind, Robot]:
    """The classifier of the robot commissioned in a folder, and the robot as it is believed."""
    source = str(file_of(folder))
    settings = DiagnosisSettings.of(read_node_sections(source, _NODES), source)
    return Kind(settings.classifier, settings.residuals.bands), load_robot(source)


def tour(number: int, folder: Path, seed: int, fault: str | None, rates: Rates = ()) -> Drive:
    """A drive with bumps of robot `number`, commissioned in a folder; `fault` as another_drive."""
    real, (_, believed) = made(number, folder, rates).real, commissioned_kind(folder)
    chosen = another_drive(Drive(seed, real, believed, load_mission("square")), seed, fault)
    random = np.random.default_rng([seed, 5])
    count = int(random.integers(0, 4))
    return evolve(chosen, bumps=bumps(believed, random, count, chosen.length))


def seed_of(number: int, index: int) -> int:
    """Of a drive of robot `number`; faulty ones begin with FAULTY, healthy ones with HEALTHY."""
    return _FIRST_SEED + _ROBOT * number + index


@frozen
class Task:
    """One drive of a commissioned robot."""

    number: int
    seed: int
    fault: str | None  # as `tour`
    folder: Path
    ramps: bool = False
    without: tuple[str, ...] = ()  # topics
    rates: Rates = ()


def scored(task: Task) -> Outcome:
    """How it is diagnosed."""
    kind, believed = commissioned_kind(task.folder)
    chosen = tour(task.number, task.folder, task.seed, task.fault, task.rates)
    if task.ramps:
        chosen = over_ramps(chosen)
    labelled = simulated_drive(chosen, task.without)
    named = named_by(kind, rebanded(labelled.frames, kind.bands), believed)
    if task.fault is None:
        return score_healthy(labelled, named)
    return score_faulty(chosen, labelled, twin_of(chosen, labelled), named)


def _outcomes(title: str, tasks: Sequence[Task]) -> list[Outcome]:
    return each(scored, tasks, title=title)


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="recordings and commissionings")
    parser.add_argument("--robots", type=int, nargs="+", default=[0, 1, 2, 3], help="numbers")
    parser.add_argument("--hours", type=float, default=1.0, help="healthy, of all robots together")
    parser.add_argument("--drives", type=int, default=96, help="with a fault, of all together")
    parser.add_argument("--skip", type=int, default=0, help="of each robot's drives with a fault")
    parser.add_argument("--ramps", action="store_true", help="healthy tours lead over ramps")
    parser.add_argument("--without-imu", action="store_true", help="robots that have none")
    parser.add_argument(
        "--rates",
        type=float,
        nargs=2,
        default=(),
        metavar=("ENCODERS", "POWER"),
        help="messages per second [Hz]",
    )
    parser.add_argument("--json", type=Path, help="write the report to this file as well")
    options = parser.parse_args(arguments)
    without, rates = (IMU_TOPIC,) if options.without_imu else (), tuple(options.rates)
    folders = {number: options.out / f"robot_{number}" for number in options.robots}
    robots = []
    for number, folder in folders.items():
        robots.append(commissioned(number, folder, without, rates))
        print(json.dumps(robots[-1]), flush=True)

    def tasks(count: int, first: int, fault: str | None, ramps: bool = False) -> list[Task]:
        found = []
        for index in range(count):
            number, k = options.robots[index % len(folders)], index // len(folders)
            seed = seed_of(number, first + k)
            found.append(Task(number, seed, fault, folders[number], ramps, without, rates))
        return found

    healthy = math.ceil(options.hours * 3600.0 / _DRIVE_SECONDS)
    sick = _outcomes("faulty", tasks(options.drives, FAULTY + options.skip, "fault"))
    well = _outcomes("healthy", tasks(healthy, HEALTHY, None, options.ramps))
    if sick or well:
        publish({"robots": robots, "diagnosis": report(sick, well)}, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
