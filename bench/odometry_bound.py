"""The slip odometry's bound without an IMU: an estimator that knows what no estimator can know.

    .venv/bin/python bench/odometry_bound.py [--all]

The drives of slips_practice that have no IMU, by one that knows which wheels slide when, the
floor's traction, slope and drag and the robot's parameters: what it still lacks is what pushes and
how slides begin. Printed are its end errors and velocity errors while wheels slide, over those of
wheel odometry, and the distance of slip ratios to the true ones within 0.1 s; beside them those of
the slip odometry without an IMU by the same measures, every drive counting alike.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from odometry import ratio, recordings
from slippery import slip_error, speed_error, true_twists
from tqdm import tqdm

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.reference import reference_of
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import end_error, estimated_path
from tomr_power_model.cli import run_main
from tomr_power_model.geometry.poses import moved
from tomr_power_model.messages.types import ODOMETRY
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import GRAVITY, Robot, load_robot
from tomr_power_model.slides.body import STICKING, ContactBody, body_of
from tomr_power_model.topics.inputs import Complaints

Array = NDArray[np.float64]


def _is_within(spells: Sequence[Sequence[float]], times: Array) -> NDArray[np.bool_]:
    within = np.zeros(len(times), dtype=bool)
    for begin, end in spells:
        within |= (times >= begin) & (times <= end)
    return within


def _advanced(
    body: ContactBody, twist: Array, force: Array, pull: Array, drag: float, dt: float
) -> Array:
    """Twist after dt by the forces of the contacts [N] and the pull of a slope [N]."""
    along = np.tanh(body.along @ twist / STICKING) * body.load
    wrench = body.rows.T @ force + pull - drag * (body.along.T @ along)
    turning = twist[2] * np.array([twist[1], -twist[0], 0.0])
    return np.asarray(twist + dt * (np.linalg.solve(body.inertia, wrench) + turning))


def _floor(
    floor: Mapping[str, float], yaw: float, body: ContactBody, robot: Robot
) -> tuple[Array, float]:
    """Pull of a slope on the body [N], and the rollers' drag."""
    fall = body.mass * GRAVITY * np.sin(floor.get("slope", 0.0))
    heading = floor.get("azimuth", 0.0) - yaw
    described = robot.everywhere("contact.roller_drag", "coefficient")[0]
    pull = fall * np.array([np.cos(heading), np.sin(heading), 0.0])
    return pull, floor.get("roller_drag", described)


@frozen
class Ride:
    """What the wheels do, and which of them slide."""

    times: Array  # s, (n,)
    by_wheels: Array  # twists as the wheels turn, (n, 3)
    slides: NDArray[np.bool_]  # (n, 3)
    traction: float  # of a wheel that slides, over its load


def known_twists(ride: Ride, yaw: float, floor: Mapping[str, float], robot: Robot) -> Array:
    """Twists, (n, 3): wheels that grip hold them, those that slide pull with all there is."""
    body, _ = body_of(robot)
    found = [ride.by_wheels[0]]
    steps = zip(np.diff(ride.times), ride.by_wheels[1:], ride.slides[1:], strict=True)
    for elapsed, by_wheels, slides in steps:
        dt, twist = min(float(elapsed), 0.1), found[-1]
        force = ride.traction * body.load * np.tanh(body.rows @ (by_wheels - twist) / STICKING)
        # Whatever force wheels that grip are given here, holding them takes it back.
        twist = _advanced(body, twist, force, *_floor(floor, yaw, body, robot), dt)
        grips = body.rows[~slides]
        if len(grips):
            light = np.linalg.solve(body.inertia, grips.T)
            twist = twist + light @ np.linalg.solve(grips @ light, grips @ (by_wheels - twist))
        yaw += dt * float(twist[2])
        found.append(twist)
    return np.array(found)


def _end(start: Array, twists: Array, times: Array) -> Array:
    pose = start
    for twist, dt in zip(twists[1:], np.minimum(np.diff(times), 0.1), strict=True):
        pose = moved(pose, float(dt) * twist)
    return pose


@frozen
class Errors:
    """Of the end [m], of the velocity while wheels slide [m/s], of slip ratios."""

    end: float
    speed: float
    slip: float


def _streamed(bag: Path, robot: Robot, use_power: bool) -> list[Estimate]:
    core = SlipOdometry(robot, OdometrySettings(use_imu=False, use_power=use_power))
    with open_recording(bag) as recording:
        return list(estimates(recording, robot, core, Complaints()))


def errors_of(bag: Path, truth: Path, robot: Robot) -> tuple[dict[str, Errors], float]:
    """Of wheel odometry, of the slip odometry without an IMU and of the bound; way driven [m]."""
    known = json.loads(truth.read_text())
    plain, ours = (_streamed(bag, robot, use_power) for use_power in (False, True))
    with open_recording(truth.parent / "truth_odom" / bag.name) as recording:
        (topic,) = [name for name, kind in recording.topics.items() if kind == ODOMETRY]
        true = reference_of(recording, topic)
    stamps = np.array([item.stamp_ns for item in plain], dtype=np.int64)
    times = np.asarray(1e-9 * (stamps - int(known["t0_ns"])), dtype=np.float64)
    slides = np.stack([_is_within(spells, times) for spells in known["slipping"]], axis=1)
    poses, floor = true.at(stamps), known["floor"]
    by_wheels, real = np.array([item.twist for item in plain]), true_twists(poses, times)
    ride = Ride(times, by_wheels, slides, floor.get("patch_friction", floor["friction"]))
    bound = known_twists(ride, float(poses[0, 2]), floor, robot)
    rows = body_of(robot)[0].rows
    rims, ground = by_wheels @ rows.T, bound @ rows.T
    larger = np.maximum(np.maximum(np.abs(rims), np.abs(ground)), 0.02)
    end = float(np.hypot(*(_end(poses[0], bound, times) - poses[-1])[:2]))
    found = {
        "wheels": (end_error(estimated_path(plain), true), by_wheels, np.zeros_like(rims)),
        "ours": (
            end_error(estimated_path(ours), true),
            np.array([item.twist for item in ours]),
            np.array([item.slip for item in ours]),
        ),
        "bound": (end, bound, (rims - ground) / larger),
    }
    errors = {
        name: Errors(
            end=end,
            speed=speed_error(twists - real, np.asarray(slides.any(axis=1))),
            slip=slip_error(slip, rims - real @ rows.T, rims),
        )
        for name, (end, twists, slip) in found.items()
    }
    return errors, float(np.hypot(*(np.diff(poses[:, :2], axis=0).T)).sum())


def _drives(is_all: bool) -> Iterator[tuple[Path, Path, Robot]]:
    folder = recordings() / "slips_practice"
    for robot in sorted(path.parent for path in folder.glob("slips/*/robot.yaml")):
        known = load_robot(robot / "robot.yaml")
        for bag in sorted((robot / "drives").iterdir()):
            truth = folder / "slips_truth" / robot.name / f"{bag.name}.json"
            if is_all or not json.loads(truth.read_text())["imu"]:
                yield bag, truth, known


def bound(is_all: bool) -> int:
    """How good an estimator without IMU can be that knows the true parameters."""
    found, ways = [], []
    for bag, truth, robot in tqdm(list(_drives(is_all)), unit="drive"):
        errors, way = errors_of(bag, truth, robot)
        found.append(errors)
        ways.append(way)
        for name, item in errors.items():
            tqdm.write(
                f"{bag.name}: {name:6} end {item.end:.3f} of {way:.1f} m; while slipping "
                f"{item.speed:.3f} m/s; slip ratio {item.slip:.3f}"
            )
    if not found:
        print("skipped: slips_practice is absent; set TOMR_RECORDINGS")
        return 0
    plain = np.array([errors["wheels"].end for errors in found])
    for name in ("ours", "bound"):
        ends = ratio(np.array([errors[name].end for errors in found]), plain, np.array(ways))
        speeds = [[errors[one].speed for one in (name, "wheels")] for errors in found]
        pooled = np.sqrt(np.nanmean(np.square(speeds), axis=0))
        slip = math.sqrt(np.mean([errors[name].slip ** 2 for errors in found]))
        print(
            f"{name}: end {ends['ratio']:.2f} [{ends['low']:.2f}, {ends['high']:.2f}] of plain's, "
            f"velocity while slipping {pooled[0] / pooled[1]:.2f}, slip ratio {slip:.3f}"
        )
    return 0


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--all", action="store_true", help="drives with an IMU, too, without it")
    return bound(parser.parse_args(arguments).all)


if __name__ == "__main__":
    sys.exit(run_main(_main))
