"""How soon normal is named again when a fault has ended, in the drive that `make soak` drives.

    .venv/bin/python bench/fault_ends.py [--cases 40] [--first-seed 1]

The reference robot in MuJoCo; a fault comes after 3 s, lasts 3 to 6 s and ends at a random moment
of the drive. `make soak` asks for 2 s. Times are on the grid of decisions, 0.05 s. Besides: of
classifiers that are begun anew 2, 3 and 4 s after an end, as a node that was killed is, those that
name a fault, where all is well.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from itertools import product

import numpy as np
from attrs import frozen
from disturbances import Item, stamped
from pool import each

from tomr_demo.acts import twist_at
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import FAULTLESS, NORMAL, NOT_OBSERVABLE, STATES
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS, shipped_robot
from tomr_sim_bridge.plant.samples import command_sample
from tomr_sim_bridge.plant.simulation import Simulation

FAULTS = ("control_signal_lost", "encoder_lost", "floor_slippery")
WELL = (STATES[NORMAL].name, NOT_OBSERVABLE.name)
# Time from the start of the drive [s], and what the robot's state was called.
Said = list[tuple[float, str]]

_TICK = NANOSECONDS // 20
_AHEAD = NANOSECONDS // 5  # by which commands are early, as the soak's are
_AFTER = 8.0  # s, that a drive goes on
_LEAP = 60.0  # s
_ANEW = (2.0, 3.0, 4.0)  # s after an end
_EPOCH = 1_700_000_000 * NANOSECONDS  # where the soak's drive begins


@frozen
class Ending:
    """A fault that comes and goes; times from the start of a drive [s]."""

    fault: str
    wheel: int  # 1 to 3; of a slippery floor none
    begin_ns: int  # stamp at which the drive starts
    comes: float
    ends: float
    rest: tuple[float, float] = (math.inf, math.inf)  # in which it is commanded to stand
    seed: int = 0  # of the sensors' noise
    leap: float = 0.0  # of all stamps in the middle of the fault


def random_ending(fault: str, seed: int, leap: float = 0.0) -> Ending:
    """A fault's end at a moment that depends on the seed alone."""
    random = np.random.default_rng(seed)
    begin = _EPOCH + _TICK * int(random.integers(900 * 20))
    length = 0.05 * int(random.integers(60, 121))
    wheel = int(random.integers(1, WHEELS + 1))
    return Ending(fault, wheel, begin, 3.0, 3.0 + length, seed=seed, leap=leap)


def said_of(ending: Ending) -> tuple[Said, list[ResidualFrame]]:
    """What each decision of a drive with a fault says, and what all are made of."""
    robot = shipped_robot("reference")
    simulation = Simulation(robot, ending.seed, start_ns=ending.begin_ns)
    pipeline = Pipeline(robot, DiagnosisSettings.of({}, ""))
    topics = {item.topic for item in pipeline.inputs}
    comes, ends = (round(20.0 * time) for time in (ending.comes, ending.ends))
    leaps = (comes + ends) // 2
    wheel = {} if ending.fault == "floor_slippery" else {"wheel": ending.wheel}
    said: Said = []
    frames: list[ResidualFrame] = []
    for count in range(ends + round(20.0 * _AFTER)):
        if count in (comes, ends):
            simulation.set_fault(ending.fault, severity=float(count == comes), **wheel)
        stamp = ending.begin_ns + _TICK * count
        by = to_ns(ending.leap) if count >= leaps else 0
        stands = ending.rest[0] <= 0.05 * count < ending.rest[1]
        ahead = stamp + _AHEAD
        twist = (0.0, 0.0, 0.0) if stands else twist_at(ahead / NANOSECONDS % 1e5)
        command = command_sample(ahead, *twist)
        simulation.command(*twist, stamp_ns=ahead)
        given = stamped(Item(ahead, command.topic, to_bag(command.message)), ahead + by)
        pipeline.take(given.topic, given.message, stamp + by)
        for sample in simulation.step_to(stamp + _TICK):
            if sample.topic in topics:
                item = Item(sample.stamp_ns, sample.topic, to_bag(sample.message))
                item = stamped(item, item.stamp_ns + by)
                step = pipeline.take(item.topic, item.message, item.stamp_ns)
                frames += step.frames
                said += [
                    ((d.stamp_ns - by - ending.begin_ns) / NANOSECONDS, d.state.name)
                    for d in step.diagnoses
                ]
    return said, frames


def accusing(frames: Sequence[ResidualFrame], begin_ns: int) -> bool:
    """Whether a classifier that begins at a stamp names a fault."""
    settings = DiagnosisSettings.of({}, "").classifier
    classifier = FaultClassifier.of(settings, shipped_robot("reference"))
    found = [classifier.classify(frame) for frame in frames if frame.stamp_ns >= begin_ns]
    return any(d.state.name not in FAULTLESS for d in found if d is not None)


def after(ending: Ending) -> tuple[float, int]:
    """How a drive goes on: `back_after`, and how many that were begun anew name a fault."""
    said, frames = said_of(ending)
    ends = ending.begin_ns + to_ns(ending.ends + ending.leap)
    accused = [accusing(frames, ends + to_ns(seconds)) for seconds in _ANEW]
    return back_after(ending, said), sum(accused)


def back_after(ending: Ending, said: Said) -> float:
    """Time from a fault's end until it is well [s]; NaN: the fault was not named, inf: never."""
    before = [name for time, name in said if time <= ending.ends]
    if before[-1] in WELL:
        return math.nan
    return next(
        (time - ending.ends for time, name in said if time > ending.ends and name in WELL), math.inf
    )


def main(arguments: Sequence[str] | None) -> int:
    """Let faults end, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=40, help="of each fault (default 40)")
    parser.add_argument("--first-seed", type=int, default=1, help="default: 1")
    parser.add_argument("--jobs", type=int, help="processes (default: one a core)")
    options = parser.parse_args(arguments)
    seeds = range(options.first_seed, options.first_seed + options.cases)
    print(
        "| fault ends | named before | normal again after, median | 95th percentile | most ", end=""
    )
    print("| begun anew: accuse |\n|---|---|---|---|---|---|")
    for fault, leap in product(FAULTS, (0.0, _LEAP)):
        endings = [random_ending(fault, seed, leap) for seed in seeds]
        found = np.array(each(after, endings, title=fault, jobs=options.jobs))
        times, accused = found[:, 0], int(found[:, 1].sum())
        named = np.sort(times[~np.isnan(times)])
        middle, high = np.quantile(named, [0.5, 0.95], method="higher")
        most = named[-1]
        name = f"{fault}, stamps leap" if leap else fault
        print(
            f"| {name} | {len(named)} of {len(times)} | {middle:.2f} s | {high:.2f} s "
            f"| {most:.2f} s | {accused} of {len(_ANEW) * len(times)} |"
        )
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(main))
