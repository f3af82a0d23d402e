"""A recording through the offline diagnosis: its states, and the power residuals of every tick."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from pool import each
from stages import as_arrays, pipeline_of, steps_of

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import (
    NOT_ENOUGH,
    NOT_OBSERVABLE,
    STALE,
    STATES,
    WAITING,
    State,
)
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, ResidualFrame
from tomr_power_model.model.ticks import NANOSECONDS

Array = NDArray[np.float64]
Change = tuple[float, str, int | None]  # stamp [s], state, wheel 1..3

# The score knows the paper's six: what is none of them is unknown.
_SCORED = {
    NOT_OBSERVABLE.name: "not_observable",
    **dict.fromkeys((WAITING.name, STALE.name, NOT_ENOUGH.name), "stale"),
}


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
    pipeline = pipeline_of(robot)
    frames: list[ResidualFrame] = []
    diagnoses: list[Diagnosis] = []
    for passed_ns, step in steps_of(bag, pipeline):
        if passed_ns > seconds * NANOSECONDS:
            break
        frames += step.frames
        diagnoses += step.diagnoses
    residual, modelled = as_arrays(frames)
    motors = list(MOTORS)
    return Played(
        changes=changes_of(diagnoses),
        stamp_ns=np.array([frame.stamp_ns for frame in frames], dtype=np.int64),
        period_ns=pipeline.settings.model.ticks.period,
        measured=residual[:, motors] + modelled[:, motors],
        command_path=residual[:, motors],
        encoder_path=residual[:, list(ENCODERS)],
    )


def changes_of(diagnoses: Iterable[Diagnosis]) -> tuple[Change, ...]:
    """Changes of the published state as the score wants them, by the stamp that said it first."""
    changes: list[Change] = []
    for diagnosis in diagnoses:
        state = scored_name(diagnosis.state)
        wheel = None if diagnosis.wheel is None else diagnosis.wheel + 1
        if not changes or changes[-1][1:] != (state, wheel):
            changes.append((diagnosis.stamp_ns / NANOSECONDS, state, wheel))
    return tuple(changes)


def scored_name(state: State) -> str:
    """A state of the suite as the score calls it: `motor system fault 2` is motor_system_2."""
    paper = "unknown" if state.paper is None else STATES[state.paper].name
    return _SCORED.get(state.name, paper.replace(" fault", "").replace(" ", "_"))


def play_all(
    bags: Iterable[Path], robot: Path, seconds: float = float("inf")
) -> dict[Path, Played]:
    """Diagnose recordings side by side."""
    chosen = tuple(bags)
    played = each(partial(play, robot=robot, seconds=seconds), chosen)
    return dict(zip(chosen, played, strict=True))
