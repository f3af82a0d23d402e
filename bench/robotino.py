"""The real Robotino as it stands: share of each state, and the error of the modelled current.

    .venv/bin/python bench/robotino.py [--surface gray] [--robot robotino_v2]

Plays every drive of a surface through the three stages. The description holds the published
constants and the friction of the bench only; nothing is fitted to the drives.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from pool import each
from stages import as_arrays, pipeline_of, steps_of

from tomr_fault_diag.classifier.states import FAULTLESS
from tomr_fault_diag.diagnosis.summary import Summariser
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS
from tomr_power_model.cli import run_main
from tomr_power_model.robot import read_node_sections
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.dataset import default_dataset

Array = NDArray[np.float64]


@frozen
class Drive:
    """One drive: ticks by state, stale ticks, and measured and modelled values (n, 3)."""

    states: Counter[str]
    stale: float
    measured: Array  # A
    commanded: Array  # A, modelled from the command
    derived: Array  # A, modelled from the encoders
    speed_error: Array  # rad/s


def play(bag: Path, robot: str) -> Drive:
    """Play one recording through the stages."""
    pipeline = pipeline_of(robot)
    summariser, frames = Summariser(pipeline.robot.wheel_names), []
    for _, step in steps_of(bag, pipeline):
        for diagnosis in step.diagnoses:
            summariser.diagnosis(diagnosis, [])
        for frame in step.frames:
            summariser.frame(frame)
            frames.append(frame)
    residual, modelled = as_arrays(frames)
    motors, encoders = list(MOTORS), list(ENCODERS)
    summary = summariser.summary()
    counts = Counter({name: round(share * summary.ticks) for name, share in summary.shares.items()})
    return Drive(
        counts,
        float(np.mean(np.isnan(residual[:, motors]))),
        residual[:, motors] + modelled[:, motors],
        modelled[:, motors],
        modelled[:, encoders],
        residual[:, list(SPEEDS)],
    )


def scores(measured: Array, modelled: Array) -> dict[str, float]:
    """Accuracy, NRMSE and R2 over ticks; R2 also over the mean of each drive's motor."""
    known = np.isfinite(measured) & np.isfinite(modelled)
    error = measured[known] - modelled[known]
    spread = measured[known].std()
    return {
        "accuracy": 1.0 - float(np.abs(error).sum() / np.abs(measured[known]).sum()),
        "nrmse": float(np.sqrt(np.mean(error**2)) / spread),
        "r2": 1.0 - float(np.mean(error**2) / spread**2),
        "mean_measured_A": float(measured[known].mean()),
        "mean_modelled_A": float(modelled[known].mean()),
    }


def report(drives: Sequence[Drive]) -> dict[str, object]:
    """Everything of all drives together."""
    states: Counter[str] = sum((drive.states for drive in drives), Counter())
    ticks = sum(states.values())
    measured = np.concatenate([drive.measured for drive in drives])
    means = np.array([np.nanmean(drive.measured, axis=0) for drive in drives])
    modelled = np.array([np.nanmean(drive.commanded, axis=0) for drive in drives])
    speed = np.concatenate([drive.speed_error for drive in drives])
    return {
        "drives": len(drives),
        "ticks": ticks,
        "states": {name: count / ticks for name, count in states.most_common()},
        "drives_with_a_fault_named": sum(
            any(name not in FAULTLESS for name in drive.states) for drive in drives
        ),
        "stale_share_of_motor_currents": float(np.mean([drive.stale for drive in drives])),
        "current_from_command": scores(
            measured, np.concatenate([drive.commanded for drive in drives])
        ),
        "current_from_encoders": scores(
            measured, np.concatenate([drive.derived for drive in drives])
        ),
        "mean_current_per_drive_and_motor": scores(means, modelled),
        "speed_rms_error_rad_s": float(np.sqrt(np.nanmean(speed**2))),
    }


def is_absent(dataset: Path) -> bool:
    """Whether there is nothing to play, which is said."""
    if not dataset.exists():
        print(f"skipped: {dataset} is absent; set TOMR_RECORDINGS", file=sys.stderr)
    return not dataset.exists()


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--surface", default="gray")
    parser.add_argument("--dataset", type=Path, default=default_dataset())
    parser.add_argument("--robot", default="robotino_v2", help="shipped name or robot.yaml")
    options = parser.parse_args(arguments)
    if is_absent(options.dataset):
        return 0
    with TemporaryDirectory() as folder:
        out = Path(folder) / "bags"
        with redirect_stdout(sys.stderr):
            import_robotino([str(options.dataset), "--out", str(out), "--surface", options.surface])
        # A description is not scored on the drives it was fitted to.
        fitted = read_node_sections(options.robot, ["tomr_calibrate"]).get("bags", ())
        bags = [
            bag
            for bag in sorted((out / options.surface).iterdir())
            if options.surface != "gray" or bag.name not in cast(Sequence[str], fitted)
        ]
        drives = each(partial(play, robot=options.robot), bags)
    print(json.dumps(report(drives), indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
