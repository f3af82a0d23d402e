"""Drives by the thousand: what the classifiers learn from."""

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.classifier.belief import CONTROLS, ENCODERS, HYPOTHESES, six_of
from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive, wheel_of
from tomr_training.labels import SLIPPING, Flags, GroundTruth, Noise, deviates
from tomr_training.planar.plant import run_plant
from tomr_training.planar.population import training_drive
from tomr_training.planar.residuals import Compared, compare
from tomr_training.planar.schedule import faulty_ticks
from tomr_training.planar.sensors import Signals

# True states are the hypotheses, finer than what is named: the wheel of a lost signal is known.
NORMAL, SLIP, CONTROL, MOTOR = 0, 1, CONTROLS.start, ENCODERS.start
STATE_OF = six_of(np.eye(HYPOTHESES)).argmax(axis=1).astype(np.int8)  # that each is to be named
IGNORED = -1  # aftermath of a fault, a healthy robot that slips

_SETTLED = 10  # ticks without a difference after which a robot is as good as healthy
_CHUNK = 20  # drives that a process takes at a time

Labels = NDArray[np.int8]


@frozen
class LabelledTicks:
    """One drive tick by tick."""

    compared: Compared
    labels: Labels  # (ticks,)


def generate(seeds: range) -> Iterator[LabelledTicks]:
    """Drive once per seed, on all cores; the result depends on the seeds alone."""
    _simulated(seeds[0])  # so that what numba compiles is there before the processes are
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(_simulated, seeds, chunksize=_CHUNK)
        yield from tqdm(found, total=len(seeds), desc=f"{len(seeds)} drives", unit="drive")


def _simulated(seed: int) -> LabelledTicks:
    return simulate(training_drive(_reference(), seed))


@cache
def _reference() -> Robot:
    return shipped_robot("reference")


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
        labels[now] = class_of(fault)
        after = ~now & (np.cumsum(now) == now.sum())
        labels[after & _recently(shown | now, _SETTLED)] = IGNORED
    return labels


def class_of(fault: PlannedFault) -> int:
    """True state while a fault is in force."""
    wheel = wheel_of(fault)
    if wheel is None:
        return SLIP
    return (CONTROL if fault.fault_id == "control_signal_lost" else MOTOR) + wheel


def _recently(flags: Flags, ticks: int) -> Flags:
    """Whether a flag held now or within so many ticks before."""
    found = flags.copy()
    for back in range(1, ticks + 1):
        found[back:] |= flags[:-back]
    return found
