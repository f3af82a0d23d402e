"""A recording through the offline diagnosis: its states, and the power residuals of every tick."""

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import NOT_OBSERVABLE, UNKNOWN
from tomr_fault_diag.cli.diagnose import STAGE_NODES
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, ResidualFrame
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot, read_node_sections

Array = NDArray[np.float64]
Change = tuple[float, str, int | None]  # stamp [s], state, wheel 1..3

JOBS = 2
# The suite's `unknown` says that no power can be compared; the score's says: an unknown fault.
_SCORED = {NOT_OBSERVABLE.name: "not_observable", UNKNOWN.name: "stale"}


@frozen
class Played:
    """What the diagnosis said of one recording; n ticks."""

    changes: tuple[Change, ...]
    stamp_ns: NDArray[np.int64]  # end of each tick, (n,)
    period_ns: int
    measured: Array  # power of each motor [W], (n, 3), NaN where there is no sample
    command_path: Array  # measured - predicted from the command [W], (n, 3)
    encoder_path: Array  # measured - predicted from the encoders [W], (n, 3)


def play(bag: Path, robot: Path, seconds: float = float("inf")) -> Played:
    """Diagnose a recording, or its first seconds, with a robot's description."""
    settings = DiagnosisSettings.of(read_node_sections(robot, STAGE_NODES), str(robot))
    pipeline = Pipeline(load_robot(robot), settings)
    frames: list[ResidualFrame] = []
    diagnoses: list[Diagnosis] = []
    with open_recording(bag) as recording:
        for receive_ns, step in diagnose(recording, pipeline):
            if receive_ns - recording.start_ns > seconds * NANOSECONDS:
                break
            frames += step.frames
            diagnoses += step.diagnoses
    command, encoder = _watts(frames, MOTORS), _watts(frames, ENCODERS)
    return Played(
        changes=changes_of(diagnoses),
        stamp_ns=np.array([frame.stamp_ns for frame in frames], dtype=np.int64),
        period_ns=settings.model.ticks.period,
        measured=command.sum(axis=2),
        command_path=command[:, :, 0],
        encoder_path=encoder[:, :, 0],
    )


def _watts(frames: Iterable[ResidualFrame], which: range) -> Array:
    """Residual and what is modelled [W] of some residuals, (n, 3, 2)."""
    rows = [
        [(frame.residuals[index].residual, frame.residuals[index].modelled) for index in which]
        for frame in frames
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, len(which), 2)


def changes_of(diagnoses: Iterable[Diagnosis]) -> tuple[Change, ...]:
    """Changes of the published state as the score wants them, by the stamp that said it first."""
    changes: list[Change] = []
    for diagnosis in diagnoses:
        state = scored_name(diagnosis.state.name)
        wheel = None if diagnosis.wheel is None else diagnosis.wheel + 1
        if not changes or changes[-1][1:] != (state, wheel):
            changes.append((diagnosis.stamp_ns / NANOSECONDS, state, wheel))
    return tuple(changes)


def scored_name(state: str) -> str:
    """A state of the suite as the score calls it: `motor system fault 2` is motor_system_2."""
    return _SCORED.get(state, state.replace(" fault", "").replace(" ", "_"))


def play_all(
    bags: Iterable[Path], robot: Path, seconds: float = float("inf")
) -> dict[Path, Played]:
    """Diagnose recordings side by side."""
    chosen = tuple(bags)
    with ProcessPoolExecutor(JOBS) as pool:
        played = pool.map(partial(play, robot=robot, seconds=seconds), chosen)
        return dict(zip(chosen, tqdm(played, total=len(chosen), disable=None), strict=True))
