"""The slip odometry's bound without an IMU: an estimator that knows what no estimator can know.

    .venv/bin/python bench/odometry_bound.py [--all]

The drives of slips_practice that have no IMU, by one that knows which wheels slide when, the
floor's traction, slope and drag and the robot's parameters: what it still lacks is what pushes and
how slides begin. Printed are end errors and velocity errors while wheels slide, over those of wheel
odometry, and the distance of slip ratios to the true ones within 0.1 s.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from odometry import ratio, recordings
from slippery import slip_error

from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.reference import reference_of
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.cli import run_main
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
        twist = _advanced(body, twist, slides * force, *_floor(floor, yaw, body, robot), dt)
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
        pose = _moved(pose, twist, float(dt))
    return pose


def _real(poses: Array, times: Array) -> Array:
    """Twists in base_link by differences of poses."""
    step = (
        np.diff(poses, axis=0, prepend=poses[:1]) / np.diff(times, prepend=times[0] - 1.0)[:, None]
    )
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.stack(
        [c * step[:, 0] + s * step[:, 1], c * step[:, 1] - s * step[:, 0], step[:, 2]], 1
    )


def bound_of(bag: Path, truth: Path, robot: Robot) -> dict[str, float]:
    """Errors of a drive: of the end [m], of the velocity while sliding [m/s], of slip ratios."""
    known = json.loads(truth.read_text())
    with open_recording(bag) as recording:
        core = SlipOdometry(robot, OdometrySettings(use_imu=False, use_power=False))
        items = list(estimates(recording, robot, core, Complaints()))
    with open_recording(truth.parent / "truth_odom" / bag.name) as recording:
        (topic,) = [name for name, kind in recording.topics.items() if kind == ODOMETRY]
        true = reference_of(recording, topic)
    stamps = np.array([item.stamp_ns for item in items], dtype=np.int64)
    times = np.asarray(1e-9 * (stamps - int(known["t0_ns"])), dtype=np.float64)
    slides = np.stack([_is_within(spells, times) for spells in known["slipping"]], axis=1)
    poses, floor = true.at(stamps), known["floor"]
    by_wheels, real = np.array([item.twist for item in items]), _real(poses, times)
    ride = Ride(times, by_wheels, slides, floor.get("patch_friction", floor["friction"]))
    twists = known_twists(ride, float(poses[0, 2]), floor, robot)
    sliding = slides.any(axis=1)
    v, v_plain = (
        float(np.sqrt(np.mean(np.sum((one - real)[sliding, :2] ** 2, axis=1))))
        for one in (twists, by_wheels)
    )
    rows = body_of(robot)[0].rows
    rims, ground = by_wheels @ rows.T, twists @ rows.T
    ratios = (rims - ground) / np.maximum(np.maximum(np.abs(rims), np.abs(ground)), 0.02)
    ends = [_end(poses[0], one, times) - poses[-1] for one in (twists, by_wheels)]
    return {
        "ours": float(np.hypot(*ends[0][:2])),
        "plain": float(np.hypot(*ends[1][:2])),
        "way": float(np.hypot(*(np.diff(poses[:, :2], axis=0).T)).sum()),
        "v": v,
        "v_plain": v_plain,
        "slip": slip_error(ratios, rims - real @ rows.T, rims),
    }


def _moved(pose: Array, twist: Array, dt: float) -> Array:
    yaw = pose[2] + 0.5 * dt * twist[2]
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, turn = dt * twist
    return np.asarray(pose + np.array([c * x - s * y, s * x + c * y, turn]))


def bound(is_all: bool) -> int:
    """How good an estimator without IMU can be that knows the true parameters."""
    folder = recordings() / "slips_practice"
    if not folder.exists():
        print(f"skipped: {folder} is absent; set TOMR_RECORDINGS")
        return 0
    rows = []
    for robot in sorted(path.parent for path in folder.glob("slips/*/robot.yaml")):
        known = load_robot(robot / "robot.yaml")
        for bag in sorted((robot / "drives").iterdir()):
            truth = folder / "slips_truth" / robot.name / f"{bag.name}.json"
            if json.loads(truth.read_text())["imu"] and not is_all:
                continue
            rows.append(found := bound_of(bag, truth, known))
            print(
                f"{bag.name}: end {found['plain']:.3f} -> {found['ours']:.3f} m on "
                f"{found['way']:.1f} m; while slipping {found['v_plain']:.3f} -> "
                f"{found['v']:.3f} m/s; slip ratio {found['slip']:.3f}",
                flush=True,
            )
    ends = np.array([[row["ours"], row["plain"], row["way"]] for row in rows]).T
    print(", ".join(f"{name} {value:.3g}" for name, value in ratio(*ends).items()))
    speeds = np.array([[row["v"], row["v_plain"]] for row in rows])
    pooled = np.sqrt(np.nanmean(speeds**2, axis=0))
    slip = np.sqrt(np.mean([row["slip"] ** 2 for row in rows]))
    print(
        f"velocity while slipping over plain's: {pooled[0] / pooled[1]:.2f}; slip ratio {slip:.3f}"
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
