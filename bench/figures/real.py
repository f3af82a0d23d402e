"""The real Robotino's straight drives, imported and read as a calibration reads them."""

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
from attrs import frozen
from calibration_robotino import Straight, drives_in
from numpy.typing import NDArray
from stages import pipeline_of
from tqdm import tqdm

from figures.result import Missing
from figures.simulated import Played, gathered
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_power_model.calibration.samples import Samples, samples_of
from tomr_power_model.drive.read import read_drive
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import Robot, load_robot
from tomr_power_model.wang2024 import Wang2024Model
from tomr_power_model.wang2024.fit import Samples as PaperSamples
from tomr_power_model.wang2024.fit import fit_wang2024
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.dataset import default_dataset

Array = NDArray[np.float64]

ROBOT = "robotino_v2_gray"
_SPAN, _WINDOW = 0.3, 0.005  # s, as bench/calibration.py robotino
STARTING = 1.0  # s, left out of a drive's mean: the wheels slip at the start


@frozen
class RealDrive:
    """One drive; motor power [W] is |i| (R |i| + k |omega|), its voltage being modelled."""

    drive: Straight
    samples: Samples

    @property
    def measured(self) -> Array:
        """Power of the motors' sum [W], (n,)."""
        return np.asarray(self.samples.measured[:, :3].sum(axis=1))

    @property
    def steady(self) -> NDArray[np.bool_]:
        return np.asarray(self.samples.time > STARTING)


def robot() -> Robot:
    """The Robotino with what was fitted to 36 drives on the gray floor."""
    return load_robot(ROBOT)


def drives(surface: str, scratch: Path, speeds: Sequence[float] = ()) -> list[RealDrive]:
    """The drives of a floor, of all speeds [m/s] or some; imported once per `scratch`.

    Raises Missing without the recordings.
    """
    dataset, folder = default_dataset(), scratch / f"robotino_{surface}"
    if not dataset.exists():
        raise Missing(f"{dataset} is absent: set TOMR_RECORDINGS to the folder that holds robotino")
    if not folder.exists():
        with redirect_stdout(sys.stderr):
            import_robotino([str(dataset), "--out", str(folder), "--surface", surface])
    described = robot()
    chosen = [item for item in drives_in(folder) if not speeds or item.speed in speeds]
    return [
        RealDrive(item, samples_of(read_drive(item.path, described), described, _SPAN, _WINDOW))
        for item in tqdm(chosen, desc=f"reading, {surface}", unit="drive", leave=False)
    ]


def as_streamed(item: RealDrive) -> Played:
    """A drive through the stages; motor columns are currents [A]."""
    with open_recording(item.drive.path) as recording:
        steps = [step for _, step in diagnose(recording, pipeline_of(ROBOT))]
        return gathered(steps, recording.start_ns)


def paper_model(fitted: Sequence[RealDrive]) -> Wang2024Model:
    """The paper's model fitted to some drives."""
    motion = [item.samples.mean_motion for item in fitted]
    samples = PaperSamples(
        WheelMotion(
            np.concatenate([item.speed for item in motion]),
            np.concatenate([item.acceleration for item in motion]),
        ),
        np.concatenate([item.samples.measured[:, :3] for item in fitted]),
    )
    return Wang2024Model.of(robot(), fit_wang2024(robot(), samples))
