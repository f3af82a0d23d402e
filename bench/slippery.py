"""Slips of robots in MuJoCo whose descriptions lack physics, without an IMU, or with one.

    .venv/bin/python bench/slippery.py --out DIR [--robots 8] [--first 20] [--imu]

Each robot (bench/commissioned.py: values up to 5 % off, three effects left out of its robot.yaml)
drives some minutes on each kind of floor, half of the time with encoders of 64 counts. Printed are,
of each kind, end errors and velocity errors while wheels slide, of wheel odometry and of
tomr_odometry; how much of the sliding is reported, and how much where nothing slides; the distance
of slip ratios to the true ones within 0.1 s; how often the true place is in the 95 % ellipse.
With --imu half of the IMUs have biases of up to 0.15 m/s^2 and 0.015 rad/s, and all more noise.
Recordings are kept in DIR and not made again. About 15 s of one core per drive.
"""

import argparse
import math
import sys
import zlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from commissioned import made
from numpy.typing import NDArray
from odometry import ratio
from pool import each
from record import record_mission

from tomr_odometry.estimate import NOT_USED, Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.reference import reference_of
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import end_error, estimated_path
from tomr_power_model.cli import run_main
from tomr_power_model.geometry.poses import turned
from tomr_power_model.model.ticks import Arrival
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
_NEAR = 5  # estimates: 0.1 s
_ELLIPSE = 5.991  # 95 % of two degrees of freedom
_GYRO_BIAS, _FORCE_BIAS = 0.015, 0.15  # rad/s, m/s^2, at most
_GYRO_NOISE, _FORCE_NOISE = 0.002, 0.03


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
    slip: float  # RMSE of the ratios
    inside: float  # share of the time in the ellipse
    is_left_out: bool  # the IMU, taken for one that is not as described


class _Biased(SlipOdometry):
    """With an IMU that is worse than the simulated one."""

    def __init__(self, robot: Robot, settings: OdometrySettings, random: Random) -> None:
        super().__init__(robot, settings)
        biases = np.array([_GYRO_BIAS, _FORCE_BIAS, _FORCE_BIAS]) * random.uniform(-1.0, 1.0, 3)
        self._biases, self._random = biases * (random.random() < 0.5), random

    def imu(self, stamp_ns: int, values: tuple[float, ...]) -> Arrival:
        felt, noise = list(values), np.array([_GYRO_NOISE, _FORCE_NOISE, _FORCE_NOISE])
        added = self._biases + noise * self._random.standard_normal(3)
        for place, off in zip((2, 3, 4), added.tolist(), strict=True):
            felt[place] += off
        return super().imu(stamp_ns, tuple(felt))


def _estimated(bag: Path, robot: Robot, settings: OdometrySettings, seed: int) -> list[Estimate]:
    core = _Biased(robot, settings, np.random.default_rng([seed, 3]))
    with open_recording(bag) as recording:
        return list(estimates(recording, robot, core, Complaints()))


def true_twists(poses: Array, times: Array) -> Array:
    """Twists in base_link, of poses in the odometry frame at times [s], (n, 3) each."""
    return turned(np.gradient(poses, times, axis=0), -poses[:, 2])


def speed_error(off: Array, slides: NDArray[np.bool_]) -> float:
    """RMS of what twists are off by along the floor while wheels slide [m/s]; NaN: none does."""
    return math.sqrt(np.mean(np.sum(off[slides, :2] ** 2, axis=1))) if slides.any() else math.nan


def slip_error(ours: Array, sliding: Array, rims: Array) -> float:
    """Distance of ratios to the range of the true ones within 0.1 s, RMS, from 5 cm/s on."""
    larger = np.maximum(np.abs(rims), np.abs(rims - sliding))
    true = np.where(larger > 0.02, sliding / np.maximum(larger, 0.02), 0.0)
    near = np.stack([np.roll(true, by, axis=0) for by in range(-_NEAR, _NEAR + 1)])
    off = ours - np.clip(ours, near.min(axis=0), near.max(axis=0))
    counts = larger > 0.05
    counts[:_NEAR] = counts[-_NEAR:] = False
    return float(np.sqrt(np.mean(off[counts] ** 2)))


def _inside(ours: Sequence[Estimate], poses: Array) -> float:
    """Share of the time in which the true place is in the ellipse; the starts on each other."""
    first = ours[0].pose
    places = first + turned(poses - poses[0], first[2] - poses[0, 2])
    off = (places - np.array([item.pose for item in ours]))[:, :2]
    covariance = np.array([item.pose_covariance[:2, :2] for item in ours]) + 1e-6 * np.eye(2)
    square = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off)
    return float(np.mean(square < _ELLIPSE))


def met(bag: Path, description: Path, use_imu: bool) -> Met:
    """One drive."""
    robot, seed = load_robot(description), zlib.crc32(f"{bag.parent.name} {bag.name}".encode())
    wheels = OdometrySettings(use_imu=False, use_power=False)
    plain, ours = (
        _estimated(bag, robot, given, seed) for given in (wheels, OdometrySettings(use_imu=use_imu))
    )
    with open_recording(bag) as recording:
        reference = reference_of(recording, "ground_truth/odom")
    paths = [estimated_path(items) for items in (plain, ours)]
    stamps = paths[1].stamps
    poses = reference.at(stamps)
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    poses, ours, at = poses[known], [ours[k] for k in known], {one.stamp_ns: one for one in plain}
    plain = [at.get(item.stamp_ns, plain[-1]) for item in ours]
    real = true_twists(poses, np.asarray(1e-9 * stamps[known], dtype=np.float64))
    off = [np.array([item.twist for item in items]) - real for items in (plain, ours)]
    rows = body_of(robot)[0].rows
    sliding = off[0] @ rows.T
    slides = np.asarray((np.abs(sliding) > _SLIDING).any(axis=1))
    reported = np.array([item.is_slipping for item in ours])
    speeds = [speed_error(one, slides) for one in off]
    return Met(
        ends=(end_error(paths[0], reference), end_error(paths[1], reference)),
        speeds=(speeds[0], speeds[1]),
        way=float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()),
        reported=float(reported[slides].mean()) if slides.any() else math.nan,
        false=float(reported[~slides].mean()),
        slip=slip_error(np.array([item.slip for item in ours]), sliding, (off[0] + real) @ rows.T),
        inside=_inside(ours, poses),
        is_left_out=any(dict(item.sensors)["imu/data"].startswith(NOT_USED) for item in ours),
    )


def scored(task: tuple[int, str], folder: Path, use_imu: bool) -> Met:
    """Record a drive unless it is there, and score it."""
    number, kind = task
    robot = folder / f"robot_{number}"
    if not (robot / kind).exists():
        real, chosen = drawn(number, kind, robot)
        record_mission(chosen.mission, real, chosen.seed, robot / kind)
    return met(robot / kind, robot / "robot.yaml", use_imu)


def _line(kind: str, found: Sequence[Met]) -> str:
    plain, ours = np.array([item.ends for item in found]).T
    ends = ratio(ours, plain, np.array([item.way for item in found]))
    pooled = np.sqrt(np.nanmean(np.square([item.speeds for item in found]), axis=0))
    reported = np.nanmean([item.reported for item in found])
    return (
        f"{kind:7} end {ends['plain_m']:.3f} -> {ends['ours_m']:.3f} m, ratio {ends['ratio']:.2f} "
        f"[{ends['low']:.2f}, {ends['high']:.2f}], worse {100 * ends['worse']:.0f} % of "
        f"{len(found)}; sliding {pooled[0]:.3f} -> {pooled[1]:.3f} m/s, reported "
        f"{100 * reported:.0f} %; of the rest {100 * np.mean([row.false for row in found]):.1f} %; "
        f"slip ratio {np.sqrt(np.mean([item.slip**2 for item in found])):.3f} (median "
        f"{np.median([item.slip for item in found]):.3f}); in the ellipse "
        f"{100 * np.mean([item.inside for item in found]):.0f} %"
        f"; IMU left out of {sum(item.is_left_out for item in found)}"
    )


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--first", type=int, default=20, help="number of the first robot")
    parser.add_argument("--imu", action="store_true", help="use the IMU, made worse")
    parser.add_argument("--jobs", type=int, help="processes (default: one a core)")
    options = parser.parse_args(arguments)
    numbers = range(options.first, options.first + options.robots)
    tasks = [(number, kind) for kind in KINDS for number in numbers]
    work = partial(scored, folder=options.out, use_imu=options.imu)
    rows = each(work, tasks, jobs=options.jobs)
    for kind in KINDS:
        print(_line(kind, [row for row, task in zip(rows, tasks, strict=True) if task[1] == kind]))
    slid = [row for row in rows if row.reported == row.reported]
    speeds = np.sqrt(np.mean(np.square([row.speeds for row in slid]), axis=0))
    print(f"all: sliding {speeds[0]:.3f} -> {speeds[1]:.3f} m/s, ratio {speeds[1] / speeds[0]:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
