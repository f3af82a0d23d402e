"""Recordings through the three stages, and the residuals of their frames as arrays."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_fault_diag.diagnosis.settings import STAGE_NODES, DiagnosisSettings
from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot, read_node_sections

Array = NDArray[np.float64]


def pipeline_of(robot: str | Path) -> Pipeline:
    """The stages as a description and its sections of single nodes set them."""
    settings = DiagnosisSettings.of(read_node_sections(robot, STAGE_NODES), str(robot))
    return Pipeline(load_robot(robot), settings)


def steps_of(bag: Path, pipeline: Pipeline) -> Iterator[tuple[int, Step]]:
    """What each message of a recording brings about, and when it came [ns after the first]."""
    with open_recording(bag) as recording:
        for receive_ns, step in diagnose(recording, pipeline):
            yield receive_ns - recording.start_ns, step


def frames_of(bag: Path, robot: str | Path, settings: DiagnosisSettings) -> list[ResidualFrame]:
    """What the residual stage says of a recording, tick by tick."""
    pipeline = Pipeline(load_robot(robot), settings)
    return [frame for _, step in steps_of(bag, pipeline) for frame in step.frames]


def as_arrays(frames: Sequence[ResidualFrame]) -> tuple[Array, Array]:
    """Residuals, and the modelled values that they are against, (n, 10) each."""
    residual = [[item.residual for item in frame.residuals] for frame in frames]
    modelled = [[item.modelled for item in frame.residuals] for frame in frames]
    shape = len(frames), RESIDUALS
    return np.array(residual).reshape(shape), np.array(modelled).reshape(shape)
