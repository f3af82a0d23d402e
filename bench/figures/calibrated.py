"""A simulated robot off its description, and both power models fitted to the same drives of it."""

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path

from attrs import frozen
from calibration_mujoco import FITTED, Job, deviating, record
from tqdm import tqdm

from figures import paper_model
from figures.simulated import PHYSICAL, ROBOT, reference
from tomr_power_model.calibrate_cli import main as tomr_calibrate
from tomr_power_model.robot import Robot, load_robot

SEED = 1  # of the robot's deviations


@frozen
class Calibrated:
    """The robot as it is, as it was fitted, and the stages' parameters by power model."""

    plant: Robot
    robot: Robot
    models: Mapping[str, Mapping[str, object]]


def calibrated(scratch: Path) -> Calibrated:
    """Drive, fit; what is already in the folder `scratch` is not made anew."""
    out = scratch / "fitted.yaml"
    jobs = [Job(SEED, *mission, False, scratch) for mission in FITTED]
    bags = [job.path for job in jobs]
    if not out.exists():
        for job in tqdm(jobs, desc="drives to fit", unit="drive", leave=False):
            record(job)
        arguments = [*map(str, bags), "--robot", ROBOT, "--out", str(out)]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            if tomr_calibrate(arguments):
                raise RuntimeError("the simulated robot was not calibrated")
    robot = load_robot(str(out))
    coefficients = paper_model.fitted(robot, bags)
    return Calibrated(
        deviating(reference(), SEED),
        robot,
        {"physical": PHYSICAL, "wang2024": paper_model.parameters(coefficients)},
    )
