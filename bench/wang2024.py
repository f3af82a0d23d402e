"""The power model of Wang 2024 beside the physical one, on drives that were not fitted.

    .venv/bin/python bench/wang2024.py [--deviation 0.05] [--out coefficients.yaml]

Drives the simulated robot, fits the paper's coefficients to some of the drives and scores both
models on the others: accuracy = 1 - sum|P - P_model| / sum|P| and NRMSE over whole drives, from
the command and from the encoders. --deviation lets the robot differ from its description.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from pool import each
from record import record_mission
from stages import as_arrays, frames_of

from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, TOTAL
from tomr_power_model.calibration.wang2024_samples import joined, read_samples
from tomr_power_model.cli import run_main
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.robot import Robot, load_robot
from tomr_power_model.wang2024 import Coefficients
from tomr_power_model.wang2024.fit import Samples, fit_wang2024
from tomr_training.drives import every_value

Array = NDArray[np.float64]
Scores = dict[str, dict[str, float]]

FITTED = (("square", 1), ("circle", 1), ("random_tour", 1), ("random_tour", 2))
SCORED = (
    ("paper_phases", 3),
    ("random_tour", 11),
    ("random_tour", 12),
    ("random_tour", 13),
    ("random_tour", 14),
)


@frozen
class Played:
    """One drive as a model sees it, by tick: motors 1-3, their sum, the whole robot [W], (n, 5)."""

    measured: Array
    commanded: Array
    derived: Array  # from the encoders; the whole robot is not


def deviating(robot: Robot, share: float, seed: int) -> Robot:
    """A robot whose every value is off its description by up to a share of it."""
    random = np.random.default_rng(seed)

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - share, 1.0 + share))

    return every_value(robot, off)


def record(planned: tuple[str, int], deviation: float, deviation_seed: int, folder: Path) -> Path:
    """Drive a mission with a seed and keep the recording."""
    name, seed = planned
    plant = deviating(load_robot("reference"), deviation, deviation_seed)
    path = folder / f"{name}_{seed}"
    record_mission(name, plant, seed, path)
    return path


def samples_of(bags: Sequence[Path], robot: Robot) -> Samples:
    """All that is known of some recordings, one after the other."""
    return joined([read_samples(bag, robot) for bag in bags])


def play(bag: Path, robot: str, parameters: dict[str, object]) -> Played:
    """A recording through the stages, with the power model that the parameters choose."""
    settings = DiagnosisSettings.of(parameters, "bench")
    residual, modelled = as_arrays(frames_of(bag, robot, settings))
    motors, encoders = list(MOTORS), list(ENCODERS)

    def columns(of_motors: Array, total: Array) -> Array:
        return np.column_stack([of_motors, of_motors.sum(axis=1), total])

    total = modelled[:, TOTAL]
    return Played(
        columns(residual[:, motors] + modelled[:, motors], residual[:, TOTAL] + total),
        columns(modelled[:, motors], total),
        columns(modelled[:, encoders], np.full_like(total, np.nan)),
    )


_NAMES = ("motor 1", "motor 2", "motor 3", "motors", "robot")


def scores(drives: Sequence[Played]) -> dict[str, Scores]:
    """Accuracy and NRMSE of each motor, of their sum and of the whole robot."""
    measured = np.concatenate([item.measured for item in drives])
    found: dict[str, Scores] = {}
    for path in ("commanded", "derived"):
        modelled = np.concatenate([getattr(item, path) for item in drives])
        found[path] = {
            name: {
                "accuracy": accuracy(measured[:, column], modelled[:, column]),
                "nrmse": nrmse(measured[:, column], modelled[:, column]),
            }
            for column, name in enumerate(_NAMES)
            if np.isfinite(modelled[:, column]).any()
        }
    return found


def rows(title: str, found: dict[str, Scores]) -> Iterator[str]:
    """Scores as lines of a table."""
    for path, by_name in found.items():
        cells = [
            f"{100 * by_name[name]['accuracy']:6.2f} {by_name[name]['nrmse']:5.3f}"
            if name in by_name
            else " " * 12
            for name in _NAMES
        ]
        yield f"{title:46} {path:9} " + "  ".join(cells)


def _main(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    robot = load_robot(options.robot)
    with TemporaryDirectory() as name:
        folder = Path(name)
        make = partial(
            record, deviation=options.deviation, deviation_seed=options.seed, folder=folder
        )
        planned = (*FITTED, *SCORED)
        bags = each(make, planned, title="driving")
        samples = samples_of(bags[: len(FITTED)], robot)
        fitted = fit_wang2024(robot, samples)
        if options.out:
            fitted.save(options.out)
        chosen = {
            "physical": _PHYSICAL,
            "wang2024": _wang2024(fitted),
            "wang2024, M fitted": _wang2024(fit_wang2024(robot, samples, turning=True)),
        }
        report = {}
        for model, parameters in chosen.items():
            run = partial(play, robot=options.robot, parameters=parameters)
            played = each(run, bags, title=model)
            by_drive = {
                f"{mission}, seed {seed}": scores([item])
                for (mission, seed), item in zip(planned, played, strict=True)
            }
            unseen = scores(played[len(FITTED) :])
            report[model] = {"drives": by_drive, "not fitted": unseen}
    if options.json:
        print(json.dumps({"models": report, "coefficients": _values(fitted)}, indent=2))
        return 0
    _print(report)
    return 0


_PHYSICAL: dict[str, object] = {"power_model": "physical"}


def _wang2024(fitted: Coefficients) -> dict[str, object]:
    values = {
        f"wang2024.{name}": list(value) if isinstance(value, tuple) else value
        for name, value in _values(fitted).items()
    }
    return {"power_model": "wang2024", **values}


def _values(fitted: Coefficients) -> dict[str, object]:
    return {name: getattr(fitted, name) for name in Coefficients.__annotations__}


def _print(report: dict[str, dict[str, object]]) -> None:
    head = "  ".join(f"{name:>12}" for name in _NAMES)
    print(f"{'accuracy in %, NRMSE':46} {'from':9} {head}")
    for model, found in report.items():
        by_drive = found["drives"]
        assert isinstance(by_drive, dict)
        for number, (title, of_drive) in enumerate(by_drive.items()):
            note = " (fitted)" if number < len(FITTED) else ""
            print(*rows(f"{model}: {title}{note}", of_drive), sep="\n")
        unseen = found["not fitted"]
        assert isinstance(unseen, dict)
        print(*rows(f"{model}: all not fitted", unseen), sep="\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--deviation", type=float, default=0.0, help="largest of each value from the description"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the deviation")
    parser.add_argument("--robot", default="reference", help="description that the models get")
    parser.add_argument("--out", type=Path, help="keep the fitted coefficients in this file")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


if __name__ == "__main__":
    sys.exit(run_main(_main))
