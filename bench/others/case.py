"""A case as all methods get it: the same recordings, aligned alike, and the same simulator."""

from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import ParameterisedRobot
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.request import Request

Array = NDArray[np.float64]


@frozen
class Case:
    """What a user has: a description, a recording to fit and one of another drive."""

    identity: str
    base: ParameterisedRobot
    robot: Robot
    real: RecordingSimulation
    held: RecordingSimulation


def read_case(folder: Path) -> Case:
    """Read a case. Raises InputError where its description or a recording is bad."""
    ready = prepared(
        Request(
            folder / "robot.yaml", (folder / "real",), folder / "sim", (folder / "real_holdout",)
        )
    )
    return Case(folder.name, ready.base, ready.robot, ready.real[0], ready.held[0])


def residuals(simulation: RecordingSimulation, value: Array) -> list[Array]:
    """Measured less simulated, by channel."""
    rows = rows_of(simulation.channels)
    return [item.value - value[part] for item, part in zip(simulation.channels, rows, strict=True)]


def powers(channels: tuple[Channel, ...]) -> list[int]:
    """Which channels count: the motors' power, or the total where that is all there is."""
    motors = [number for number, item in enumerate(channels) if item.kind == "power"]
    return motors or [number for number, item in enumerate(channels) if item.kind == "total"]


def nrmse(channels: tuple[Channel, ...], left: list[Array]) -> float:
    """RMS of what is left of the power over the standard deviation of the measured, pooled."""
    chosen = powers(channels)
    errors = np.concatenate([left[number] for number in chosen])
    spread = np.concatenate([channels[n].value - channels[n].value.mean() for n in chosen])
    return float(np.sqrt(np.mean(errors**2) / np.mean(spread**2)))
