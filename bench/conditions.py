"""Slow changes that are no fault, in MuJoCo: are they reported, and is nothing accused meanwhile?

    .venv/bin/python bench/conditions.py [--robots 2] [--drives 9]

Each robot drives random healthy tours one after another, its description as it was built but for
one change: hot windings, stiff grease, a payload, drivers that draw more, a battery that gives
less. Last the way round: a bearing that drags more from tour to tour, which must be named. Robots
and tours are of seeds that nothing else uses.
"""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor

from attrs import evolve, frozen
from tqdm import tqdm

from tomr_fault_diag.classifier.judges import make_judge
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.severity import Severity, SeverityWatch
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import DRAGGING, FAULTLESS, MOTOR, STATES
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.cli import run_main
from tomr_power_model.robot import Robot, shipped_robot
from tomr_training.drives import another_drive, random_drive
from tomr_training.simulated_drive import simulated_drive

_FIRST_SEED = 78_000_000
_APART = 1000  # seeds between the tours of a robot
_PERIOD = 50_000_000  # ns
_FRICTION = ("friction.coulomb", "friction.viscous")
_GROWS = 0.03  # N m from tour to tour

Change = Callable[[Robot, int], Robot]  # of a plant, in a tour


def _motors(resistance: float) -> Change:
    def change(robot: Robot, _: int) -> Robot:
        first, second, third = (
            evolve(motor, resistance=resistance * motor.resistance) for motor in robot.motors
        )
        return evolve(robot, motors=(first, second, third))

    return change


def _scaled(effects: Sequence[str], factor: float, more: float = 0.0) -> Change:
    def change(robot: Robot, _: int) -> Robot:
        physics = dict(robot.physics)
        for effect in effects:
            one, two, three = (
                None if wheel is None else {key: factor * v + more for key, v in wheel.items()}
                for wheel in physics[effect]
            )
            physics[effect] = (one, two, three)
        return evolve(robot, physics=physics)

    return change


def _payload(factor: float) -> Change:
    return lambda robot, _: evolve(
        robot, mass=factor * robot.mass, inertia_z=factor * robot.inertia_z
    )


def _supply(factor: float) -> Change:
    return lambda robot, _: evolve(
        robot,
        supply=evolve(robot.supply, nominal_voltage=factor * robot.supply.nominal_voltage),
    )


def _drags(robot: Robot, tour: int) -> Robot:
    """Of wheel 2."""
    one, two, three = robot.physics["friction.coulomb"]
    assert two is not None
    grown = {"torque": two["torque"] + _GROWS * tour}
    return evolve(robot, physics={**robot.physics, "friction.coulomb": (one, grown, three)})


CHANGES: dict[str, Change] = {
    "as described": lambda robot, _: robot,
    "windings +20 %": _motors(1.2),
    "windings +40 %": _motors(1.4),
    "friction +30 %": _scaled(_FRICTION, 1.3),
    "friction +70 %": _scaled(_FRICTION, 1.7),
    "payload +20 %": _payload(1.2),
    "payload +50 %": _payload(1.5),
    "standby +1 W": _scaled(("electrical.driver_standby",), 1.0, 1.0),
    "supply -8 %": _supply(0.92),
    "wheel 2 drags more and more": _drags,
}


@frozen
class Found:
    """What a robot was called, and what was reported at the end."""

    change: str
    mass: float  # kg, as described
    ticks: int
    alarms: Counter[str]  # faults named, of other wheels too
    named: float | None  # s of driving until the dragging wheel was named
    reported: tuple[Severity, ...]


def _frames(change: str, seed: int, tours: int) -> Iterator[tuple[int, ResidualFrame]]:
    """Frames of all tours, each with its tour, in one time."""
    first = random_drive(shipped_robot("reference"), seed, None)
    offset = 0
    for tour in range(tours):
        drive = another_drive(first, seed + _APART * tour)
        mission = evolve(drive.mission, payload=0.0, floor_friction=0.9)
        plant = CHANGES[change](drive.believed, tour)
        frames = simulated_drive(evolve(drive, plant=plant, mission=mission)).frames
        for frame in frames:
            yield tour, evolve(frame, stamp_ns=frame.stamp_ns + offset)
        offset += frames[-1].stamp_ns - frames[0].stamp_ns + _PERIOD


def driven(task: tuple[str, int, int]) -> Found:
    """One robot."""
    change, seed, tours = task
    robot = random_drive(shipped_robot("reference"), seed, None).believed
    watch = SeverityWatch(robot)
    classifier = FaultClassifier.around(make_judge(ClassifierSettings()), robot, watch)
    alarms: Counter[str] = Counter()
    named, ticks, reported = None, 0, watch.conditions
    for _, frame in _frames(change, seed, tours):
        ticks += 1
        diagnosis = classifier.classify(frame)
        reported = watch.conditions or reported
        if diagnosis is None or not diagnosis.changed or diagnosis.state.name in FAULTLESS:
            continue
        alarms[diagnosis.state.name] += 1
        if named is None and diagnosis.state in (DRAGGING[1], STATES[MOTOR + 1]):
            named = 1e-9 * _PERIOD * ticks
    return Found(change, robot.mass, ticks, alarms, named, reported)


def _line(found: Found) -> str:
    reported = "; ".join(item.words for item in found.reported) or "nothing"
    alarms = ", ".join(f"{count} {name}" for name, count in found.alarms.items()) or "none"
    late = "" if found.named is None else f"; named after {found.named:.0f} s"
    seconds = 1e-9 * _PERIOD * found.ticks
    return (
        f"{found.change:28} {found.mass:5.1f} kg {seconds:5.0f} s  alarms: {alarms}{late}\n"
        f"{'':28} reported: {reported}"
    )


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--drives", type=int, default=9, help="of each robot, one after another")
    options = parser.parse_args(arguments)
    tasks = [
        (change, _FIRST_SEED + robot, options.drives)
        for change in CHANGES
        for robot in range(options.robots)
    ]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for found in tqdm(pool.map(driven, tasks), total=len(tasks), disable=None, unit=" robots"):
            print(_line(found))
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
