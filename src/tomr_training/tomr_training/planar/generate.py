"""Drives by the thousand: what the classifiers learn from."""

import os
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_power_model.robot import Robot, shipped_robot
from tomr_training.drives import DEVIATION, Drive, bumps, random_drive
from tomr_training.labels import SLIPPING, Flags, GroundTruth, Noise, deviates
from tomr_training.planar.plant import run_plant
from tomr_training.planar.residuals import Compared, compare
from tomr_training.planar.schedule import faulty_ticks
from tomr_training.planar.sensors import Signals

# True states, finer than those that are named: of a lost signal the wheel is known as well.
NORMAL, SLIP, CONTROL, MOTOR = 0, 1, 2, 5
IGNORED = -1  # aftermath of a fault, a healthy robot that slips

_HARDEST, _LONGEST = 3.0, 0.22  # N/kg and s, of a shove
_FRICTION = (0.5, 6.0)  # of the reference's
_SETTLED = 10  # ticks without a difference after which a robot is as good as healthy
_CHUNK = 20  # drives that a process takes at a time

Labels = NDArray[np.int8]


@frozen
class LabelledTicks:
    """One drive tick by tick."""

    compared: Compared
    labels: Labels  # (ticks,)


def generate(seeds: range, title: str, kind: str | None = "any") -> Iterator[LabelledTicks]:
    """Drive once per seed, on all cores; the result depends on the seeds alone."""
    work = partial(_simulated, kind)
    work(seeds[0])  # so that what numba compiles is there before the processes are
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(work, seeds, chunksize=_CHUNK)
        yield from tqdm(found, total=len(seeds), desc=title, unit="drive")


def _simulated(kind: str | None, seed: int) -> LabelledTicks:
    return simulate(training_drive(_reference(), seed, kind))


@cache
def _reference() -> Robot:
    return shipped_robot("reference")


def training_drive(reference: Robot, seed: int, kind: str | None = "any") -> Drive:
    """A random drive, and what makes robots that are healthy look otherwise.

    Every other one is bumped before it starts, most are shoved: that is no fault. Every other
    robot has drivers that are tuned a little off as well: a real driver's loop is never known as
    well as a simulated one's. Friction is of any make, from a half to six times the reference's.
    """
    drive = random_drive(reference, seed, kind)
    random = np.random.default_rng([seed, 2])
    early = bumps(drive.believed, random, int(random.integers(0, 2)), 1.0)
    shoves = bumps(
        drive.believed,
        random,
        int(random.integers(0, 4)),
        drive.length,
        hardest=_HARDEST,
        longest=_LONGEST,
    )
    drive = _of_any_make(evolve(drive, bumps=(*drive.bumps, *early, *shoves)), random)
    if seed % 2:
        return drive
    given = drive.plant.controller

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - DEVIATION, 1.0 + DEVIATION))

    tuned = evolve(
        given,
        proportional=off(given.proportional),
        integral=off(given.integral),
        acceleration_limit=off(given.acceleration_limit),
    )
    return evolve(drive, plant=evolve(drive.plant, controller=tuned))


def _of_any_make(drive: Drive, random: np.random.Generator) -> Drive:
    """The drive with another dry friction, as really is and as described."""
    factor = float(np.exp(random.uniform(*np.log(_FRICTION))))

    def changed(robot: Robot) -> Robot:
        wheels = robot.physics["friction.coulomb"]
        first, second, third = (
            None if own is None else {"torque": factor * own["torque"]} for own in wheels
        )
        coulomb = {"friction.coulomb": (first, second, third)}
        return evolve(robot, physics={**robot.physics, **coulomb})

    return evolve(drive, plant=changed(drive.plant), believed=changed(drive.believed))


def simulate(drive: Drive) -> LabelledTicks:
    """Drive, measure and label."""
    motion = run_plant(drive)
    compared = compare(drive, Signals.of(drive, motion))
    return LabelledTicks(compared, _labels(drive, motion.truth))


def _labels(drive: Drive, truth: GroundTruth) -> Labels:
    """True states, whether they show or not: what cannot be told apart has even odds."""
    labels = np.zeros(len(truth.slip), dtype=np.int8)
    labels[truth.slip.max(axis=1) > SLIPPING] = IGNORED
    if not drive.mission.faults:
        return labels
    twin = run_plant(drive.healthy).truth
    shown = deviates(truth, twin, Noise.of(drive.plant))
    now = faulty_ticks(drive)
    for fault in drive.mission.faults:
        labels[now] = class_of(fault.fault_id, fault.settings)
        after = ~now & (np.cumsum(now) == now.sum())
        labels[after & _recently(shown | now, _SETTLED)] = IGNORED
    return labels


def class_of(fault_id: str, settings: Mapping[str, object]) -> int:
    """True class of a fault."""
    if fault_id == "floor_slippery":
        return SLIP
    wheel = int(str(settings["wheel"])) - 1
    return (CONTROL if fault_id == "control_signal_lost" else MOTOR) + wheel


def _recently(flags: Flags, ticks: int) -> Flags:
    """Whether a flag held now or within so many ticks before."""
    found = flags.copy()
    for back in range(1, ticks + 1):
        found[back:] |= flags[:-back]
    return found
