"""Drives by the thousand: what the classifiers learn from."""

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.training.drives import DEVIATION, Drive, bumps, random_drive
from tomr_fault_diag.training.labels import SLIPPING, Flags, Noise, deviates
from tomr_fault_diag.training.planar.fleet import Array, Fleet
from tomr_fault_diag.training.planar.plant import Motion, Plant
from tomr_fault_diag.training.planar.residuals import Compared, compare
from tomr_fault_diag.training.planar.schedule import STEPS, TICK, Schedule
from tomr_fault_diag.training.planar.sensors import Signals
from tomr_power_model.robot import Robot, shipped_robot

# True states, finer than those that are named: of a lost signal the wheel is known as well.
NORMAL, SLIP, CONTROL, MOTOR = 0, 1, 2, 5
UNTOLD = -1  # aftermath of a fault, a healthy robot that slips, beyond the end of the drive

_SETTLED = 10  # ticks without a difference after which a robot is as good as healthy
_BATCH = 600  # drives side by side

Labels = NDArray[np.int8]


@frozen
class Batch:
    """Drives side by side; the last index is the drive."""

    compared: Compared
    labels: Labels  # (ticks, n)


def generate(seeds: Iterable[int], title: str, kind: str | None = "any") -> list[Batch]:
    """Drive once per seed, on all cores; the result depends on the seeds alone."""
    reference = shipped_robot("reference")
    drives = sorted(
        (training_drive(reference, seed, kind) for seed in seeds), key=lambda drive: drive.length
    )
    parts = [drives[start : start + _BATCH] for start in range(0, len(drives), _BATCH)]
    with (
        ProcessPoolExecutor(os.cpu_count()) as pool,
        tqdm(total=len(drives), desc=title, unit="drive") as bar,
    ):
        found = []
        # The longest first, so that no core is left with a long one at the end.
        for batch in pool.map(simulate, reversed(parts)):
            found.append(batch)
            bar.update(batch.labels.shape[1])
    return found


def training_drive(reference: Robot, seed: int, kind: str | None = "any") -> Drive:
    """A random drive, every other one bumped before it starts: shoved, not faulty.

    Every other robot has drivers that are tuned a little off as well: a real driver's loop is
    never known as well as a simulated one's.
    """
    drive = random_drive(reference, seed, kind)
    random = np.random.default_rng([seed, 2])
    early = bumps(drive.believed, random, int(random.integers(0, 2)), 1.0)
    drive = evolve(drive, bumps=(*drive.bumps, *early))
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


def simulate(drives: Sequence[Drive]) -> Batch:
    """Drive, measure and label some drives."""
    plant = Fleet.of([d.plant for d in drives], [d.mission.payload for d in drives])
    believed = Fleet.of([d.believed for d in drives])
    schedule = Schedule.of(drives)
    motion = Plant(plant).run(schedule)
    compared = compare(believed, schedule, Signals.of(plant, drives, motion))
    return Batch(compared, _labels(drives, schedule, motion))


def per_tick(values: Array) -> Array:
    """Means over the steps of each tick."""
    return np.asarray(values.reshape(-1, STEPS, *values.shape[1:]).mean(axis=1))


def reported_speed(motion: Motion) -> Array:
    """Mean speed that ideal encoders report in each tick [rad/s], (ticks, 3, n)."""
    return np.asarray(np.diff(motion.encoder[::STEPS], axis=0) / TICK)


def _labels(drives: Sequence[Drive], schedule: Schedule, motion: Motion) -> Labels:
    """True states, whether they show or not: what cannot be told apart has even odds."""
    faulty = schedule.faulty
    labels = np.zeros(faulty.shape, dtype=np.int8)
    labels[per_tick(np.abs(motion.slip)).max(axis=1) > SLIPPING] = UNTOLD
    shown = _shown(drives, motion)
    for column, drive in enumerate(drives):
        for fault in drive.mission.faults:
            now = faulty[:, column]
            labels[now, column] = class_of(fault.fault_id, fault.settings)
            after = ~now & (np.cumsum(now) == now.sum())
            labels[after & _recently(shown[:, column] | now, _SETTLED), column] = UNTOLD
    labels[np.arange(len(labels))[:, None] >= schedule.ticks] = UNTOLD
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


def _shown(drives: Sequence[Drive], motion: Motion) -> Flags:
    """Where drives differ from the same drives without their fault, (ticks, n)."""
    ticks = len(motion.power) // STEPS
    shown = np.zeros((ticks, len(drives)), dtype=bool)
    columns = np.array([bool(drive.mission.faults) for drive in drives])
    faulty = [drive for drive in drives if drive.mission.faults]
    if not faulty:
        return shown
    plant = Fleet.of([d.plant for d in faulty], [d.mission.payload for d in faulty])
    twin = Plant(plant).run(Schedule.of([drive.healthy for drive in faulty], ticks))
    shown[:, columns] = deviates(
        per_tick(motion.power[:, :, columns]),
        reported_speed(motion)[:, :, columns],
        per_tick(twin.power),
        reported_speed(twin),
        Noise.of([drive.plant for drive in faulty]),
    )
    return shown
