"""Odometry that knows of slip, against plain wheel odometry: the Robotino, and drives with slip.

    .venv/bin/python bench/odometry.py robotino [--every 3] [--bags DIR]
    .venv/bin/python bench/odometry.py slips --out corrected
    .venv/bin/python bench/odometry.py healthy

robotino: the creep of each floor learnt on every second heading and scored on the others, and the
other way round; learnt on two floors and scored on the third. The error is that of a drive's end
when the starts are laid on each other; the ratio that of the medians, with its 95 % interval by
bootstrap over drives. `worse`: by more than 2 %, 5 mm and 0.5 % of the way. The estimator itself is
run on some of the drives.

slips: `tomr_odometry` on every drive of slips_practice; its scorer prints the figures.

healthy: the healthy drives of faults_practice with their IMU and without it: how much slip is
reported, how far from that of the wheels the pose ends, and the CPU, reading included.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from functools import partial
from itertools import compress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from pool import each

from tomr_odometry.cli import main as tomr_odometry
from tomr_odometry.creep import Creep
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.learn.cli import learnt_text
from tomr_odometry.learn.drives import Leg, read_legs
from tomr_odometry.learn.fit import Batch, fit_creep
from tomr_odometry.offline import estimates
from tomr_odometry.reference import wheel_path
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.summary import end_error, estimated_path
from tomr_power_model.cli import run_main
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot
from tomr_power_model.slides.body import body_of
from tomr_power_model.topics.inputs import Complaints
from tomr_sim_bridge.cli.import_robotino import import_robotino

Array = NDArray[np.float64]
ROBOT = "robotino_v2"
REFERENCE = "ground_truth/odom"
MARKER = float(np.radians(0.9))  # by which the camera's marker is turned
DATASETS = {"gray": "robotino", "green": "robotino", "brown": "robotino_brown"}
PLAYED = 24  # drives of a floor that the estimator itself is run on


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
    found = each(_legs, [bag for bag, _ in chosen], title=name)
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


def errors(legs: Sequence[Leg], creep: Creep) -> Array:
    """End errors of legs with a relation, those of the wheels alone, and ways [m], (3, n)."""
    batch = Batch(legs, body_of(load_robot(ROBOT))[0])
    ours = batch.errors(np.array(creep.coefficient), creep.growth)
    return np.stack([ours, batch.errors(np.zeros(3), 0.0), batch.way])


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
            halves = [list(compress(floor.legs, of)) for of in (floor.is_even, ~floor.is_even)]
            creeps = [fit_creep({name: half}, body) for half in halves]
            found = [errors(half, creep) for half, creep in zip(halves, creeps[::-1], strict=True)]
            title = f"{name}, each half of the headings by the other"
            _print(title, creeps[0], ratio(*np.concatenate(found, axis=1)))
        for name, floor in floors.items():
            others = {key: item.legs for key, item in floors.items() if key != name}
            creep = fit_creep(others, body)
            title = f"{name}, learnt on {' and '.join(others)}"
            _print(title, creep, ratio(*errors(floor.legs, creep)))
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
        each(partial(_drive, robot=robot / "robot.yaml", out=out), todo)
    scorer = [sys.executable, str(folder / "score_odometry.py"), str(options.out)]
    data = [str(folder / "slips"), str(folder / "slips_truth")]
    for which in ("drives", "healthy"):
        arguments = [*data, "--set", which, "--slip", "slip:position", "--drives"]
        done = subprocess.run([*scorer, *arguments, *options.scorer], check=False)
        if done.returncode:
            return done.returncode
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
    commands.add_parser("healthy").set_defaults(run=healthy)
    options = parser.parse_args(arguments)
    return int(options.run(options))


if __name__ == "__main__":
    sys.exit(run_main(_main))
