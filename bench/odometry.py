"""Odometry that knows of slip, against plain wheel odometry: the Robotino, and drives with slip.

    .venv/bin/python bench/odometry.py robotino [--every 3] [--bags DIR]
    .venv/bin/python bench/odometry.py slips --out corrected
    .venv/bin/python bench/odometry.py bound [--all]
    .venv/bin/python bench/odometry.py healthy

robotino: the creep of each floor learnt on every second heading and scored on the others; learnt on
two floors and scored on the third. The error is that of a drive's end when the starts are laid on
each other; the ratio that of the medians, with its 95 % interval by bootstrap over drives. `worse`:
by more than 2 %, 5 mm and 0.5 % of the way. The estimator itself is run on some of the drives.

slips: `tomr_odometry` on every drive of slips_practice; its scorer prints the figures.

bound: those drives without IMU, by one that knows which wheels slide when, the floor's traction,
slope and drag and the robot's parameters: what it still lacks is what pushes and how slides begin.

healthy: the healthy drives of faults_practice with their IMU and without it: how much slip is
reported, how far from that of the wheels the pose ends, and the CPU, reading included.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_odometry.cli import main as tomr_odometry
from tomr_odometry.creep import Creep
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.learn.cli import learnt_text
from tomr_odometry.learn.drives import Leg, read_legs
from tomr_odometry.learn.fit import Batch, fit_creep
from tomr_odometry.offline import estimates
from tomr_odometry.reference import reference_of, wheel_path
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import end_error, estimated_path
from tomr_power_model.cli import run_main
from tomr_power_model.messages.types import ODOMETRY
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import GRAVITY, Robot, load_robot
from tomr_power_model.slides.body import STICKING, ContactBody, body_of
from tomr_power_model.topics.inputs import Complaints
from tomr_sim_bridge.cli.import_robotino import import_robotino

Array = NDArray[np.float64]
ROBOT = "robotino_v2"
REFERENCE = "ground_truth/odom"
MARKER = float(np.radians(0.9))  # by which the camera's marker is turned
DATASETS = {"gray": "robotino", "green": "robotino", "brown": "robotino_brown"}
PLAYED = 6  # drives of a floor that the estimator itself is run on


@frozen
class Floor:
    """Drives on one floor: where they are, headings by their place in the series, and legs."""

    bags: tuple[Path, ...]
    legs: tuple[Leg, ...]
    is_even: NDArray[np.bool_]  # heading: 0, 10, 20 .. of 0, 5, 10 .. degrees


def recordings() -> Path:
    """Where the recordings lie."""
    return Path(os.environ.get("TOMR_RECORDINGS", "../shared/recordings"))


def _legs(bag: Path) -> Leg | None:
    found = read_legs(bag, load_robot(ROBOT), REFERENCE, MARKER)
    return found[0] if found else None


def _headings(folder: Path) -> dict[str, float]:
    rows = [line.split(",") for line in (folder / "index.csv").read_text().splitlines()]
    head = rows[0]
    bag, heading = head.index("bag"), head.index("heading_deg")
    return {row[bag]: float(row[heading] or "nan") for row in rows[1:]}


def read_floor(folder: Path, name: str, every: int) -> Floor:
    """All drives of a floor, or every n-th heading."""
    headings = _headings(folder)
    chosen = [
        (folder / bag, round(heading / 5.0))
        for bag, heading in headings.items()
        if bag.startswith(f"{name}/") and round(heading / 5.0) % every == 0
    ]
    with ProcessPoolExecutor(int(os.environ.get("OMP_NUM_THREADS", "2"))) as pool:
        found = list(
            tqdm(pool.map(_legs, [bag for bag, _ in chosen]), total=len(chosen), desc=name)
        )
    kept = [(bag, number, leg) for (bag, number), leg in zip(chosen, found, strict=True) if leg]
    return Floor(
        tuple(bag for bag, _, _ in kept),
        tuple(leg for _, _, leg in kept),
        np.array([number // every % 2 == 0 for _, number, _ in kept]),
    )


def ratio(ours: Array, plain: Array, way: Array) -> dict[str, float]:
    """Ratio of the medians, its 95 % interval, and the share of drives made worse."""
    random = np.random.default_rng(0)
    picks = random.integers(len(ours), size=(2000, len(ours)))
    spread = np.median(ours[picks], axis=1) / np.median(plain[picks], axis=1)
    low, high = np.percentile(spread, [2.5, 97.5])
    worse = ours > plain + np.maximum(np.maximum(0.02 * plain, 0.005), 0.005 * way)
    return {
        "drives": len(ours),
        "plain_m": float(np.median(plain)),
        "ours_m": float(np.median(ours)),
        "ratio": float(np.median(ours) / np.median(plain)),
        "low": float(low),
        "high": float(high),
        "worse": float(worse.mean()),
    }


def scored(legs: Sequence[Leg], creep: Creep) -> dict[str, float]:
    """A relation on some legs."""
    batch = Batch(legs, body_of(load_robot(ROBOT))[0])
    return ratio(
        batch.errors(np.array(creep.coefficient), creep.growth),
        batch.errors(np.zeros(3), 0.0),
        batch.way,
    )


def _played(bag: Path, robot: str) -> tuple[float, float]:
    """End errors of the estimator and of the wheels on a drive [m]."""
    with TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        out = Path(folder) / "out"
        tomr_odometry([str(bag), "--robot", robot, "--out", str(out), "--reference", REFERENCE])
        found = json.loads((out / "odometry.json").read_text())
    return found["end_error_m"], found["end_error_of_wheels_m"]


def played(floor: Floor, creep: Creep, folder: Path) -> dict[str, float]:
    """The estimator itself with a relation, on some drives of a floor."""
    some = range(0, len(floor.bags), max(len(floor.bags) // PLAYED, 1))
    file = folder / "robot.yaml"
    file.write_text(learnt_text(ROBOT, creep, ()))
    errors = np.array([_played(floor.bags[place], str(file)) for place in some])
    way = np.array([floor.legs[place].way for place in some])
    return ratio(errors[:, 0], errors[:, 1], way)


def robotino(options: argparse.Namespace) -> int:
    """Floors seen and not seen."""
    with TemporaryDirectory() as scratch:
        floors: dict[str, Floor] = {}
        for name, dataset in DATASETS.items():
            folder = (options.bags or Path(scratch)) / dataset
            if not (recordings() / dataset).exists():
                print(f"skipped: {recordings() / dataset} is absent; set TOMR_RECORDINGS")
                return 0
            if not folder.exists():
                with redirect_stdout(sys.stderr):
                    import_robotino([str(recordings() / dataset), "--out", str(folder)])
            floors[name] = read_floor(folder, name, options.every)
        body = body_of(load_robot(ROBOT))[0]
        for name, floor in floors.items():
            known = [leg for leg, even in zip(floor.legs, floor.is_even, strict=True) if even]
            other = [leg for leg, even in zip(floor.legs, floor.is_even, strict=True) if not even]
            creep = fit_creep({name: known}, body)
            _print(f"{name}, learnt on half of the headings", creep, scored(other, creep))
        for name, floor in floors.items():
            others = {key: item.legs for key, item in floors.items() if key != name}
            creep = fit_creep(others, body)
            _print(f"{name}, learnt on {' and '.join(others)}", creep, scored(floor.legs, creep))
            _print("    the estimator itself", creep, played(floor, creep, Path(scratch)))
    return 0


def _print(title: str, creep: Creep, found: Mapping[str, float]) -> None:
    coefficients = " ".join(f"{value:.2f}" for value in creep.coefficient)
    print(
        f"{title}: ratio {found['ratio']:.2f} [{found['low']:.2f}, {found['high']:.2f}], "
        f"{found['plain_m']:.3f} -> {found['ours_m']:.3f} m, worse {100 * found['worse']:.0f} % of "
        f"{found['drives']:.0f}; creep {coefficients}, growth {creep.growth:.2f}",
        flush=True,
    )


def _drive(bag: Path, robot: Path, out: Path) -> None:
    with redirect_stdout(sys.stderr):
        tomr_odometry([str(bag), "--robot", str(robot), "--out", str(out / bag.name)])


def slips(options: argparse.Namespace) -> int:
    """The scorer's figures."""
    folder = recordings() / "slips_practice"
    if not folder.exists():
        print(f"skipped: {folder} is absent; set TOMR_RECORDINGS")
        return 0
    robots = sorted(path.parent for path in folder.glob("slips/*/robot.yaml"))
    for robot in robots:
        bags = sorted((robot / "drives").iterdir()) + sorted((robot / "healthy").iterdir())
        out = options.out / robot.name
        out.mkdir(parents=True, exist_ok=True)
        todo = [bag for bag in bags if not (out / bag.name).exists()]
        with ProcessPoolExecutor(int(os.environ.get("OMP_NUM_THREADS", "2"))) as pool:
            list(pool.map(partial(_drive, robot=robot / "robot.yaml", out=out), todo))
    scorer = [sys.executable, str(folder / "score_odometry.py"), str(options.out)]
    data = [str(folder / "slips"), str(folder / "slips_truth")]
    for which in ("drives", "healthy"):
        arguments = [*data, "--set", which, "--slip", "slip:position", "--drives"]
        done = subprocess.run([*scorer, *arguments, *options.scorer], check=False)
        if done.returncode:
            return done.returncode
    return 0


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


def bound_of(bag: Path, truth: Path, robot: Robot) -> dict[str, float]:
    """Without IMU, by one that knows which wheels slide and all of floor and robot.

    Wheels that grip hold the twist; those that slide pull with all the traction that there is.
    """
    known = json.loads(truth.read_text())
    settings = OdometrySettings(use_imu=False)
    with open_recording(bag) as recording:
        items = list(estimates(recording, robot, SlipOdometry(robot, settings), Complaints()))
    with open_recording(truth.parent / "truth_odom" / bag.name) as recording:
        (topic,) = [name for name, kind in recording.topics.items() if kind == ODOMETRY]
        true = reference_of(recording, topic)
    body, _ = body_of(robot)
    stamps = np.array([item.stamp_ns for item in items], dtype=np.int64)
    times = np.asarray(1e-9 * (stamps - int(known["t0_ns"])), dtype=np.float64)
    slides = np.stack([_is_within(spells, times) for spells in known["slipping"]], axis=1)
    poses, floor = true.at(stamps), known["floor"]
    twist, pose, plain = items[0].twist.copy(), poses[0].copy(), poses[0].copy()
    errors = []
    for k in range(1, len(items)):
        dt = min(1e-9 * float(stamps[k] - stamps[k - 1]), 0.1)
        by_wheels = items[k].twist  # without an IMU the estimator's is that of the wheels
        limit = floor.get("patch_friction", floor["friction"]) * body.load
        force = slides[k] * limit * np.tanh(body.rows @ (by_wheels - twist) / STICKING)
        twist = _advanced(body, twist, force, *_floor(floor, pose[2], body, robot), dt)
        grips = body.rows[~slides[k]]
        if len(grips):
            light = np.linalg.solve(body.inertia, grips.T)
            twist = twist + light @ np.linalg.solve(grips @ light, grips @ (by_wheels - twist))
        pose, plain = _moved(pose, twist, dt), _moved(plain, by_wheels, dt)
        c, s = np.cos(poses[k, 2]), np.sin(poses[k, 2])
        step = (poses[k] - poses[k - 1]) / dt
        real = np.array([c * step[0] + s * step[1], c * step[1] - s * step[0]])
        if slides[k].any():
            errors.append([twist[:2] - real, by_wheels[:2] - real])
    off = np.array(errors).reshape(-1, 2, 2)
    speeds = np.sqrt(np.mean(np.sum(off**2, axis=2), axis=0)) if len(off) else np.full(2, np.nan)
    ends = [float(np.hypot(*(end[:2] - poses[-1, :2]))) for end in (pose, plain)]
    way = float(np.hypot(*(np.diff(poses[:, :2], axis=0).T)).sum())
    return {"ours": ends[0], "plain": ends[1], "way": way, "v": speeds[0], "v_plain": speeds[1]}


def _moved(pose: Array, twist: Array, dt: float) -> Array:
    yaw = pose[2] + 0.5 * dt * twist[2]
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, turn = dt * twist
    return np.asarray(pose + np.array([c * x - s * y, s * x + c * y, turn]))


def bound(options: argparse.Namespace) -> int:
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
            if json.loads(truth.read_text())["imu"] and not options.all:
                continue
            rows.append(found := bound_of(bag, truth, known))
            print(
                f"{bag.name}: end {found['plain']:.3f} -> {found['ours']:.3f} m on "
                f"{found['way']:.1f} m; while slipping {found['v_plain']:.3f} -> "
                f"{found['v']:.3f} m/s",
                flush=True,
            )
    ends = np.array([[row["ours"], row["plain"], row["way"]] for row in rows]).T
    print(", ".join(f"{name} {value:.3g}" for name, value in ratio(*ends).items()))
    speeds = np.array([[row["v"], row["v_plain"]] for row in rows])
    pooled = np.sqrt(np.nanmean(speeds**2, axis=0))
    print(f"velocity while slipping over plain's: {pooled[0] / pooled[1]:.2f}")
    return 0


def healthy(options: argparse.Namespace) -> int:
    """What is made of drives in which no wheel slides."""
    folder = recordings() / "faults_practice" / "faults" / "practice"
    if not folder.exists():
        print(f"skipped: {folder} is absent; set TOMR_RECORDINGS")
        return 0
    robot = load_robot(folder / "robot.yaml")
    for bag in sorted((folder / "healthy").iterdir()):
        for use_imu in (True, False):
            core, before = SlipOdometry(robot, OdometrySettings(use_imu=use_imu)), process_time()
            with open_recording(bag) as recording:
                items = list(estimates(recording, robot, core, Complaints()))
                spent = process_time() - before
                wheels = wheel_path(recording, robot)
            elapsed = 1e-9 * (items[-1].stamp_ns - items[0].stamp_ns)
            apart = end_error(estimated_path(items), wheels)
            ratios = np.mean([(np.abs(item.slip) > 0.1).any() for item in items])
            slipping = np.mean([item.is_slipping for item in items])
            imu = dict(items[-1].sensors).get("imu/data")
            print(
                f"{bag.name}, IMU {imu}: a ratio over 0.1 {100 * ratios:.2f} %, slipping reported "
                f"{100 * slipping:.2f} % of {elapsed:.0f} s, {apart:.4f} m from the wheels' end, "
                f"{spent / elapsed:.3f} of a core",
                flush=True,
            )
    return 0


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("robotino")
    one.add_argument("--every", type=int, default=1, help="of the headings: every n-th")
    one.add_argument("--bags", type=Path, metavar="DIR", help="where imported drives are kept")
    one.set_defaults(run=robotino)
    other = commands.add_parser("slips")
    other.add_argument("--out", type=Path, required=True, metavar="DIR")
    other.add_argument("scorer", nargs="*", help="further arguments of the scorer, after --")
    other.set_defaults(run=slips)
    last = commands.add_parser("bound")
    last.add_argument("--all", action="store_true", help="drives with an IMU, too, without it")
    last.set_defaults(run=bound)
    commands.add_parser("healthy").set_defaults(run=healthy)
    options = parser.parse_args(arguments)
    return int(options.run(options))


if __name__ == "__main__":
    sys.exit(run_main(_main))
