"""The real Robotino on its gray floor: which effects the floor adds, and how far they carry.

Fitted are the drives at 0.1 m/s and every second heading (5, 15, 25 ... degrees); scored are the
other headings, and the other speeds, 0.2 and 0.3 m/s. Power is that of the motors, from their
measured current and the modelled voltage: P = |i| (R |i| + k |omega|).
"""

import contextlib
import csv
import io
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from tomr_power_model.calibrate_cli import main as tomr_calibrate
from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.calibration.samples import Samples, samples_of
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import InverseDynamics
from tomr_power_model.model.scores import accuracy
from tomr_power_model.robot import Robot, load_robot
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.dataset import default_dataset

Array = NDArray[np.float64]

ROBOT = "robotino_v2"
_SPAN = 0.3  # s, as the description asks: the position register lags by up to 16 ms
_STARTING = 1.0  # s, left out of the mean current as the study did: wheels slip at the start
_SECOND = 1.0
_DRAG = "physics.contact.roller_drag"
_COULOMB = ("--fit", "physics.friction.coulomb.torque")
_CENTER = ("--fit", "robot.mass_center.x", "--fit", "robot.mass_center.y")
MODELS: dict[str, tuple[str, ...] | None] = {
    "bench friction": None,
    "Coulomb": _COULOMB,
    "Coulomb, roller drag": (*_COULOMB, *_CENTER, "--shared", f"{_DRAG}.coefficient"),
    "Coulomb, roller drag, slip": (
        *_COULOMB,
        *_CENTER,
        *("--shared", f"{_DRAG}.coefficient", "--shared", f"{_DRAG}.slip"),
    ),
}


@frozen
class Straight:
    """One straight drive."""

    heading: float  # degrees
    speed: float  # m/s
    path: Path

    @property
    def fitted_heading(self) -> bool:
        return round(self.heading / 5.0) % 2 == 1


SETS: dict[str, Callable[[Straight], bool]] = {
    "0.1 m/s, fitted": lambda d: d.speed == 0.1 and d.fitted_heading,
    "0.1 m/s, other headings": lambda d: d.speed == 0.1 and not d.fitted_heading,
    "0.2 m/s, other headings": lambda d: d.speed == 0.2 and not d.fitted_heading,
    "0.3 m/s, other headings": lambda d: d.speed == 0.3 and not d.fitted_heading,
    "0.2 and 0.3 m/s, other headings": lambda d: d.speed > 0.15 and not d.fitted_heading,
}


def drives_in(folder: Path) -> list[Straight]:
    """The drives of an imported data set."""
    with (folder / "index.csv").open(newline="", encoding="utf-8") as file:
        return [
            Straight(
                float(row["heading_deg"]), round(float(row["speed_m_s"]), 1), folder / row["bag"]
            )
            for row in csv.DictReader(file)
        ]


def figures_of(recorded: Drive, samples: Samples, robot: Robot) -> dict[str, Any]:
    """Accuracies of one drive, and the mean currents of its wheels."""
    measured, model = samples.measured[:, :3], modelled_power(robot, samples.motion)[:, :3]
    second = np.unique(np.floor(samples.time / _SECOND), return_inverse=True)[1]
    total = np.column_stack([measured.sum(axis=1), model.sum(axis=1)])
    by_second = np.column_stack([np.bincount(second, column) for column in total.T])
    steady = samples.time > _STARTING
    current = np.abs(InverseDynamics.of(robot).power(samples.mean_motion).current)
    rows = np.isin(recorded.power_time, samples.time[steady])
    return {
        "sample": accuracy(total[:, 0], total[:, 1]),
        "second": accuracy(by_second[:, 0], by_second[:, 1]),
        "drive": accuracy(total[:, :1].sum(axis=0), total[:, 1:].sum(axis=0)),
        "motors": [
            accuracy(measured[:, [w]].sum(axis=0), model[:, [w]].sum(axis=0)) for w in range(3)
        ],
        "energy": measured.sum(axis=0).tolist(),
        "model_energy": model.sum(axis=0).tolist(),
        "current": np.abs(recorded.power[rows]).mean(axis=0).tolist(),
        "model_current": current[steady].mean(axis=0).tolist(),
    }


def summary(found: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Medians over drives; R2 of the mean current of each wheel and drive; motors pooled."""
    current = np.array([item["current"] for item in found])
    model = np.array([item["model_current"] for item in found])
    energy = np.array([item["energy"] for item in found])
    model_energy = np.array([item["model_energy"] for item in found])
    motors = 1.0 - np.abs(energy - model_energy).sum(axis=0) / energy.sum(axis=0)
    return {
        "drives": len(found),
        **{
            name: float(np.median([item[name] for item in found]))
            for name in ("sample", "second", "drive")
        },
        "worst_motor": float(motors.min()),
        "r2_current": 1.0
        - float(np.square(current - model).sum() / np.square(current - current.mean()).sum()),
    }


def _calibrated(options: Sequence[str], drives: Sequence[Straight], out: Path) -> str:
    bags = [str(drive.path) for drive in drives]
    with contextlib.redirect_stdout(io.StringIO()):
        if tomr_calibrate([*bags, "--robot", ROBOT, "--out", str(out), *options]):
            raise RuntimeError("the drives were not calibrated")
    return str(out)


def measure_robotino() -> dict[str, Any]:
    """Import, fit each model, score."""
    dataset = default_dataset()
    if not dataset.exists():
        print(f"robotino skipped: {dataset} is absent; set TOMR_RECORDINGS", file=sys.stderr)
        return {}
    with TemporaryDirectory(prefix="tomr-robotino-") as name:
        folder = Path(name) / "bags"
        import_robotino([str(dataset), "--out", str(folder), "--surface", "gray"])
        drives = drives_in(folder)
        robot = load_robot(ROBOT)
        prepared = []
        for drive in tqdm(drives, desc="reading", unit="drive"):
            recorded = read_drive(drive.path, robot)
            prepared.append((drive, recorded, samples_of(recorded, robot, _SPAN, 0.005)))
        report: dict[str, Any] = {}
        for number, (model, options) in enumerate(MODELS.items()):
            source = ROBOT
            if options is not None:
                fitted = [drive for drive in drives if SETS["0.1 m/s, fitted"](drive)]
                source = _calibrated(options, fitted, Path(name) / f"fitted{number}.yaml")
            ours = load_robot(source)
            scored = [(d, figures_of(recorded, samples, ours)) for d, recorded, samples in prepared]
            report[model] = {
                title: summary([figures for d, figures in scored if belongs(d)])
                for title, belongs in SETS.items()
            }
            report[model]["values"] = _values(ours)
        return report


def _values(robot: Robot) -> dict[str, Any]:
    return {
        "coulomb": robot.everywhere("friction.coulomb", "torque"),
        "roller_drag": robot.everywhere("contact.roller_drag", "coefficient")[0],
        "slip": robot.everywhere("contact.roller_drag", "slip")[0],
        "mass_center": robot.mass_center[:2],
    }


def print_robotino(console: Console, found: dict[str, Any]) -> None:
    """A table by model and set of drives."""
    if not found:
        return
    names = ("drive", "worst_motor", "second", "sample", "r2_current")
    headings = ("energy", "worst motor", "1 s", "samples", "R2 current")
    table = Table(title="Robotino, gray floor, power in total: accuracy %, median", box=None)
    for heading in ("model", "drives", *headings):
        right = heading in headings
        table.add_column(heading, justify="right" if right else "left", no_wrap=True)
    for model, sets in found.items():
        for title in SETS:
            cells = [f"{100 * sets[title][name]:.1f}" for name in names[:-1]]
            table.add_row(model, title, *cells, f"{sets[title]['r2_current']:.3f}")
    console.print(table)
    for model, sets in found.items():
        values = sets["values"]
        coulomb = ", ".join(f"{value:.3f}" for value in values["coulomb"])
        console.print(
            f"{model}: Coulomb {coulomb} N m, roller drag {values['roller_drag']:.3f}, slip "
            f"{values['slip']:.2f}, mass centre {1e3 * values['mass_center'][0]:.1f}, "
            f"{1e3 * values['mass_center'][1]:.1f} mm"
        )
    console.print(
        "energy: of a whole drive; worst motor: its energy, all drives together; R2 current: of\n"
        "the mean current of every wheel and drive after its first second. Aim: energy 97 %.\n"
    )
