"""How bad a fault is said to be, against how bad it is.

    .venv/bin/python bench/severity.py [--drives 12] [--robot robot_explained.yaml] [--json FILE]

MuJoCo robots that differ from their description by up to 5 %: so many drives of each kind, drawn as
in bench/extended.py from seeds that nothing else uses. With `--robot`, a description of the robot
of `faults_practice`, the drives of that independent plant too (TOMR_RECORDINGS). Of each drive the
severity stated last counts while the right kind of state was named. A motor whose torque constant
is lower by q loses as much more in its winding as one of 1/(1 - q)^2 its resistance.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from attrs import frozen
from extended import Fleet
from faults.drawn import faulty_drive
from faults.recordings import Recordings
from pool import each
from stages import pipeline_of, steps_of

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.severity import Severity
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import (
    BURDENED,
    DEGRADED,
    DRAGGING,
    POWER_SENSOR,
    SLIP,
    STATES,
    State,
)
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.files import write_text
from tomr_training.simulated_drive import simulated_drive

FIRST_SEED = 5_000_000
_STUCK = 5.0  # N m: more than its motor has

_STATES: Mapping[str, tuple[State, ...]] = {
    "bearing_dragging": DRAGGING,
    "motor_resistance_high": DEGRADED,
    "motor_torque_weak": DEGRADED,
    "power_sensor_scaled": POWER_SENSOR,
    "load_towed": (BURDENED,),
}
# Of faults_practice, by what its truth calls a quantity: states, and the size from its value.
_PRACTICE: Mapping[str, tuple[tuple[State, ...], float]] = {
    "torque": (DRAGGING, 0.0),
    "resistance factor": (DEGRADED, -1.0),
    "scale": (POWER_SENSOR, -1.0),
    "drag": ((BURDENED,), 0.0),
    "floor friction": ((STATES[SLIP],), 0.0),
}


@frozen
class Case:
    """A fault: its kind, its true size, and what was said of it last, if anything."""

    kind: str
    true: float
    said: Severity | None

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth."""
        return self.said is not None and self.said.low <= self.true <= self.said.high


def _last(diagnoses: Iterable[Diagnosis], states: Sequence[State]) -> Severity | None:
    said = [item.severity for item in diagnoses if item.state in states]
    return next((severity for severity in reversed(said) if severity is not None), None)


def _true_size(name: str, settings: Mapping[str, object]) -> float:
    """In the unit in which its severity is stated."""
    sizes = {key: float(value) for key, value in settings.items() if isinstance(value, float)}
    if name == "motor_torque_weak":
        return 1.0 / (1.0 - sizes["loss"]) ** 2 - 1.0
    if name == "power_sensor_scaled":
        return sizes["factor"] - 1.0
    return sizes[{"bearing_dragging": "torque", "load_towed": "drag"}.get(name, "rise")]


def _simulated(task: tuple[int, str]) -> Case:
    seed, name = task
    drive, _ = faulty_drive(Fleet().drive(seed), name)
    classifier = FaultClassifier.of(ClassifierSettings(), drive.believed)
    found = (classifier.classify(frame) for frame in simulated_drive(drive).frames)
    said = _last((item for item in found if item is not None), _STATES[name])
    return Case(name, _true_size(name, drive.mission.faults[0].settings), said)


def _recorded(task: tuple[Path, str, float], robot: Path) -> Case:
    bag, quantity, value = task
    states, offset = _PRACTICE[quantity]
    steps = steps_of(bag, pipeline_of(robot))
    diagnoses = [item for _, step in steps for item in step.diagnoses]
    return Case(f"practice: {quantity}", value + offset, _last(diagnoses, states))


def _practice() -> Iterator[tuple[Path, str, float]]:
    for drive in Recordings.find().drives("drives"):
        quantity, value = drive.severity or ("", 0.0)
        is_stuck = quantity == "torque" and value > _STUCK
        if quantity in _PRACTICE and not is_stuck:
            yield drive.bag, quantity, value


def _line(kind: str, cases: Sequence[Case]) -> str:
    stated = [(case.true, case.said) for case in cases if case.said is not None]
    text = f"{kind:26}{len(cases):>4} drives{len(stated):>4} stated"
    if not stated:
        return text
    off = [abs(said.value - true) / abs(true) for true, said in stated]
    wide = [(said.high - said.low) / 2.0 / abs(true) for true, said in stated]
    held = sum(case.holds for case in cases)
    return (
        f"{text}{held:>4} intervals hold the truth; off by {100 * np.median(off):.0f} % (median), "
        f"{100 * max(off):.0f} % (most); half-width {100 * np.median(wide):.0f} % (median)"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--drives", type=int, default=12, help="of each kind (default: %(default)s)")
    add("--robot", type=Path, help="of faults_practice, for its drives too")
    add("--jobs", type=int, help="processes (default: one a core)")
    add("--json", type=Path, help="every case goes here")
    return parser


def _severities(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    seeds = range(FIRST_SEED, FIRST_SEED + options.drives)
    tasks = [(1000 * place + seed, name) for place, name in enumerate(_STATES) for seed in seeds]
    cases = each(_simulated, tasks, jobs=options.jobs)
    if options.robot is not None:
        recorded = partial(_recorded, robot=options.robot)
        cases += each(recorded, list(_practice()), jobs=options.jobs)
    for kind in dict.fromkeys(case.kind for case in cases):
        print(_line(kind, [case for case in cases if case.kind == kind]))
    if options.json is not None:
        rows = [
            (case.kind, case.true, case.said and (case.said.value, case.said.low, case.said.high))
            for case in cases
        ]
        write_text(options.json, json.dumps(rows) + "\n")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_severities))
