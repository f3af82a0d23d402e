"""Missions recorded, and recordings played through the stages."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.messages.bag import bag_message
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import Robot, load_robot
from tomr_sim_bridge.missions import drive, load_mission, start_mission
from tomr_sim_bridge.plant.samples import build

Array = NDArray[np.float64]
_START_NS = 1_700_000_000 * 1_000_000_000


def record_mission(name: str, plant: Robot, seed: int, path: Path) -> None:
    """Drive a mission with a seed and keep the recording."""
    mission = load_mission(name)
    simulation = start_mission(mission, plant, seed, _START_NS)
    with RecordingWriter(path) as writer:
        for samples in drive(mission, simulation, seed):
            for sample in samples:
                message = build(sample.message, bag_message)
                writer.write(sample.topic, sample.message.type_name, message, sample.stamp_ns)


def frames_of(bag: Path, robot: str, settings: DiagnosisSettings) -> list[ResidualFrame]:
    """What the residuals stage says of a recording, tick by tick."""
    pipeline = Pipeline(load_robot(robot), settings)
    with open_recording(bag) as recording:
        return [frame for _, step in diagnose(recording, pipeline) for frame in step.frames]


def residuals_of(frames: list[ResidualFrame]) -> tuple[Array, Array]:
    """Residuals and modelled values, (n, 10) each."""
    residual = np.array([[item.residual for item in frame.residuals] for frame in frames])
    modelled = np.array([[item.modelled for item in frame.residuals] for frame in frames])
    return residual, modelled
