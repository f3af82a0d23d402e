"""Slips without an IMU, estimated from power: robots in MuJoCo whose descriptions lack physics.

    .venv/bin/python bench/slippery.py --out DIR [--robots 8] [--first 20]

Each robot (bench/commissioned.py: values up to 5 % off, three effects left out of its robot.yaml)
drives some minutes on each kind of floor, half of the time with encoders of 64 counts. Printed are,
of each kind, end errors and velocity errors while wheels slide, of wheel odometry and of
tomr_odometry without IMU; how much of the sliding is reported, and how much where nothing slides.
Recordings are kept in DIR and not made again. About 15 s of one core per drive.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from commissioned import made
from numpy.typing import NDArray
from odometry import ratio
from record import record_mission
from tqdm import tqdm

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.reference import reference_of
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import end_error, estimated_path
from tomr_power_model.cli import run_main
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import GRAVITY, Robot, load_robot
from tomr_power_model.slides.body import body_of
from tomr_power_model.topics.inputs import Complaints
from tomr_sim_bridge.faults import check_settings
from tomr_sim_bridge.faults.floor_slippery import SLIPPERIEST
from tomr_sim_bridge.missions import load_mission
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive, another_drive

Array = NDArray[np.float64]
Random = np.random.Generator
KINDS = ("grips", "low", "slope", "ice", "shoved", "drag")
_FIRST_SEED = 400_000
_TOURS = 3  # of 18 s each
_SLIDING = 0.05  # m/s, of a contact that slides


def _planned(
    fault: str, start: float = 0.0, end: float | None = None, **given: float
) -> PlannedFault:
    settings = check_settings(fault, {"severity": 1.0, **given}, fault)
    return PlannedFault(fault, start, end, settings)


def _slippery(traction: float, floor: float, **given: float) -> PlannedFault:
    severity = math.log(floor / traction) / math.log(floor / SLIPPERIEST)
    return _planned("floor_slippery", severity=severity, **given)


def befalls(kind: str, floor: float, length: float, random: Random) -> list[PlannedFault]:
    """What the floor and others do to a drive."""
    azimuth = float(random.uniform(-math.pi, math.pi))
    if kind == "low":
        return [_slippery(float(random.uniform(0.03, 0.12)), floor)]
    if kind == "slope":
        angle = float(random.uniform(0.03, 0.08))
        pull = _planned("pushed", force=GRAVITY * math.sin(angle), azimuth=azimuth)
        return [_slippery(float(random.uniform(angle + 0.04, 0.2)), floor), pull]
    if kind == "ice":
        x, y = random.uniform(-0.5, 0.5, 2).tolist()
        return [_slippery(float(random.uniform(0.025, 0.06)), floor,
                          center_x=x, center_y=y, radius=0.5)]  # fmt: skip
    if kind == "shoved":
        pushes = []
        for at in np.arange(5.0, length, 8.0).tolist():
            end = at + float(random.uniform(0.15, 0.3))
            force, way = float(random.uniform(2.0, 5.0)), float(random.uniform(-math.pi, math.pi))
            pushes.append(_planned("pushed", at, end, force=force, azimuth=way))
        return pushes
    return []


def drawn(number: int, kind: str, folder: Path) -> tuple[Robot, Drive]:
    """The robot as it is on such a floor, and its drive; they depend on nothing else."""
    robot = made(number, folder)
    believed = load_robot(robot.described)
    seed = _FIRST_SEED + 100 * number + 10 * KINDS.index(kind)
    random = np.random.default_rng([seed, 9])
    first = Drive(0, robot.real, believed, load_mission("square"))
    tours = [another_drive(first, seed + k).mission for k in range(_TOURS)]
    phases = tuple(phase for tour in tours for phase in tour.phases)
    floor = float(random.uniform(0.4, 0.8))
    length = math.fsum(tour.plan(believed).duration for tour in tours)
    faults = befalls(kind, floor, length, random)
    mission = evolve(
        tours[0], phases=phases, payload=0.0, floor_friction=floor, faults=tuple(faults)
    )
    counts = 64 if random.random() < 0.5 else 2048
    step = 2.0 * math.pi / counts / robot.real.motors[0].gear_ratio
    physics = dict(robot.real.physics)
    if kind == "drag":
        drag = {"coefficient": float(random.uniform(0.05, 0.3))}
        physics["contact.roller_drag"] = (drag, drag, drag)
    sensors = evolve(robot.real.sensors, encoder_resolution=step)
    real = evolve(robot.real, physics=physics, sensors=sensors)
    return real, evolve(first, seed=seed, mission=mission)


@frozen
class Met:
    """How one drive was met; errors of wheel odometry and of ours."""

    ends: tuple[float, float]  # m
    speeds: tuple[float, float]  # m/s, RMS while wheels slide; NaN: they never do
    way: float  # m
    reported: float  # share of the sliding
    false: float  # share of the rest


def _estimated(bag: Path, robot: Robot, use_power: bool) -> list[Estimate]:
    core = SlipOdometry(robot, OdometrySettings(use_imu=False, use_power=use_power))
    with open_recording(bag) as recording:
        return list(estimates(recording, robot, core, Complaints()))


def met(bag: Path, description: Path) -> Met:
    """One drive."""
    robot = load_robot(description)
    plain, ours = (_estimated(bag, robot, use_power) for use_power in (False, True))
    with open_recording(bag) as recording:
        reference = reference_of(recording, "ground_truth/odom")
    paths = [estimated_path(items) for items in (plain, ours)]
    stamps = paths[1].stamps
    poses = reference.at(stamps)
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    poses, ours, plain = poses[known], [ours[k] for k in known], [plain[k] for k in known]
    change = np.gradient(poses, 1e-9 * stamps[known], axis=0)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    real = np.stack(
        [c * change[:, 0] + s * change[:, 1], c * change[:, 1] - s * change[:, 0], change[:, 2]], 1
    )
    off = [np.array([item.twist for item in items]) - real for items in (plain, ours)]
    slides = (np.abs(off[0] @ body_of(robot)[0].rows.T) > _SLIDING).any(axis=1)
    reported = np.array([item.is_slipping for item in ours])
    speeds = [
        math.sqrt(np.mean(np.sum(one[slides, :2] ** 2, axis=1))) if slides.any() else math.nan
        for one in off
    ]
    return Met(
        ends=(end_error(paths[0], reference), end_error(paths[1], reference)),
        speeds=(speeds[0], speeds[1]),
        way=float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()),
        reported=float(reported[slides].mean()) if slides.any() else math.nan,
        false=float(reported[~slides].mean()),
    )


def scored(task: tuple[int, str], folder: Path) -> Met:
    """Record a drive unless it is there, and score it."""
    number, kind = task
    robot = folder / f"robot_{number}"
    if not (robot / kind).exists():
        real, chosen = drawn(number, kind, robot)
        record_mission(chosen.mission, real, chosen.seed, robot / kind)
    return met(robot / kind, robot / "robot.yaml")


def _line(kind: str, found: Sequence[Met]) -> str:
    plain, ours = np.array([item.ends for item in found]).T
    ends = ratio(ours, plain, np.array([item.way for item in found]))
    pooled = np.sqrt(np.nanmean(np.square([item.speeds for item in found]), axis=0))
    reported = np.nanmean([item.reported for item in found])
    return (
        f"{kind:7} end {ends['plain_m']:.3f} -> {ends['ours_m']:.3f} m, ratio {ends['ratio']:.2f} "
        f"[{ends['low']:.2f}, {ends['high']:.2f}], worse {100 * ends['worse']:.0f} % of "
        f"{len(found)}; sliding {pooled[0]:.3f} -> {pooled[1]:.3f} m/s, reported "
        f"{100 * reported:.0f} %; of the rest {100 * np.mean([item.false for item in found]):.1f} %"
    )


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--first", type=int, default=20, help="number of the first robot")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    numbers = range(options.first, options.first + options.robots)
    tasks = [(number, kind) for kind in KINDS for number in numbers]
    with ProcessPoolExecutor(options.jobs) as pool:
        found = pool.map(partial(scored, folder=options.out), tasks)
        rows = list(tqdm(found, total=len(tasks), unit="drive"))
    for kind in KINDS:
        print(_line(kind, [row for row, task in zip(rows, tasks, strict=True) if task[1] == kind]))
    slid = [row for row in rows if row.reported == row.reported]
    speeds = np.sqrt(np.mean(np.square([row.speeds for row in slid]), axis=0))
    print(f"all: sliding {speeds[0]:.3f} -> {speeds[1]:.3f} m/s, ratio {speeds[1] / speeds[0]:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
