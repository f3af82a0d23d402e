"""Drives by the thousand: what the classifiers learn from."""

import math
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache, lru_cache

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.classifier.belief import ENDED, EXTERNAL, OTHER, STATE_OF
from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.robot import Robot, shipped_robot
from tomr_training.drives import Drive
from tomr_training.labels import SLIPPING, Flags, GroundTruth, Noise, deviates
from tomr_training.planar.faults import class_of, is_load
from tomr_training.planar.plant import run_plant
from tomr_training.planar.population import PER_ROBOT, bands_of, training_drive
from tomr_training.planar.residuals import Compared, compare
from tomr_training.planar.schedule import TICK, faulty_ticks
from tomr_training.planar.sensors import Signals

# Which of the paper's six each hypothesis belongs to, BEYOND them if to none.
BEYOND = len(STATES)
PAPER_OF = np.array(
    [BEYOND if state.paper is None else state.paper for state in STATE_OF[: ENDED.start]],
    dtype=np.int8,
)
IGNORED = -1  # aftermath of a fault, a healthy robot that slips

_SETTLED = 10  # ticks without a difference after which a robot is as good as healthy
_LASTING = 60  # ticks after a push in which what it did is the push's
_CHUNK = 20  # drives that a process takes at a time

Labels = NDArray[np.int8]


@frozen
class LabelledTicks:
    """One drive tick by tick."""

    compared: Compared
    labels: Labels  # (ticks,), hypotheses
    bands: BandSettings


def generate(seeds: range) -> Iterator[LabelledTicks]:
    """Drive once per seed, on all cores; the result depends on the seeds alone."""
    _simulated(seeds[0])  # so that what numba compiles is there before the processes are
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(_simulated, seeds, chunksize=_CHUNK)
        yield from tqdm(found, total=len(seeds), desc=f"{len(seeds)} drives", unit="drive")


def _simulated(seed: int) -> LabelledTicks:
    return simulate(training_drive(_reference(), seed), _bands(seed // PER_ROBOT))


@lru_cache(maxsize=2)
def _bands(number: int) -> BandSettings:
    return bands_of(_reference(), number)


@cache
def _reference() -> Robot:
    return shipped_robot("reference")


def simulate(drive: Drive, bands: BandSettings | None = None) -> LabelledTicks:
    """Drive, measure and label."""
    motion = run_plant(drive)
    compared = compare(drive, Signals.of(drive, motion))
    return LabelledTicks(compared, _labels(drive, motion.truth), bands or BandSettings())


def _labels(drive: Drive, truth: GroundTruth) -> Labels:
    """True states, whether they show or not: what cannot be distinguished has even odds."""
    labels = np.zeros(len(truth.slip), dtype=np.int8)
    labels[truth.slip.max(axis=1) > SLIPPING] = IGNORED
    if drive.bumps:
        calm = run_plant(drive.undisturbed).truth
        pushed = deviates(truth, calm, Noise.of(drive.plant))
        labels[_recently(_started(drive, len(labels)), _LASTING) & pushed] = EXTERNAL
    if not drive.mission.faults:
        return labels
    twin = run_plant(drive.healthy).truth
    shown = deviates(truth, twin, Noise.of(drive.plant))
    ever = np.zeros(len(labels), dtype=np.int64)
    for fault in drive.mission.faults:
        now = faulty_ticks(drive, fault)
        labels[now] = class_of(fault)
        if is_load(fault):  # which is all there is while no wheel slides
            slides = _recently(truth.slip.max(axis=1) > SLIPPING, _SETTLED)
            labels[now & ~slides] = EXTERNAL
        ever += now
    labels[ever > 1] = OTHER
    after = (ever == 0) & (np.cumsum(ever > 0) == (ever > 0).sum())
    labels[after & _recently(shown | (ever > 0), _SETTLED)] = IGNORED
    return labels


def _started(drive: Drive, ticks: int) -> Flags:
    """Ticks in which something pushes the robot, (ticks,)."""
    found = np.zeros(ticks, dtype=bool)
    for bump in drive.bumps:
        end = math.ceil((bump.start + bump.duration) / TICK)
        found[math.floor(bump.start / TICK) : end] = True
    return found


def _recently(flags: Flags, ticks: int) -> Flags:
    """Whether a flag held now or within so many ticks before."""
    found = flags.copy()
    for back in range(1, ticks + 1):
        found[back:] |= flags[:-back]
    return found
