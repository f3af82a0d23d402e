"""Make cases: drive, conceal, record, and keep the truth apart."""

import json
import os
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from tqdm import tqdm

from concealed import oracle
from concealed.catalogue import Case
from concealed.concealing import (
    Hidden,
    hidden_of,
    real_parameters,
    rescaled,
    truth_of,
)
from concealed.drives import random_plan
from concealed.driving import Array, Track, commands_of, track_of
from concealed.robots import (
    FAMILIES,
    Deviations,
    Nested,
    described,
    description_text,
    drawn_deviations,
    flat,
)
from concealed.sensing import SensorSet, drawn_sensors, write_recording
from tomr_power_model.messages.plain import NANOSECONDS

REAL_SECONDS, HOLDOUT_SECONDS = (60.0, 85.0), (42.0, 48.0)
_FIRST_START_S, _LAST_START_S = 1_700_000_000, 1_730_000_000
_LARGEST_LOSS = 0.9  # of a value
_LARGEST_BALANCE = 20.0  # times an effect may be scaled to cancel another


@frozen
class Job:
    """One case to be made."""

    case: Case
    seed: int
    out: Path

    @property
    def identity(self) -> str:
        return self.case.identity(self.seed)

    @property
    def folder(self) -> Path:
        return self.out / "cases" / self.identity

    @property
    def truth(self) -> Path:
        return self.out / "truth" / f"{self.identity}.json"


@frozen
class _Mission:
    """What is driven, from when on."""

    commands: tuple[Array, Array]
    seed: int  # of the rollers' places at the start
    start_ns: int


@frozen
class _Robot:
    """Everything about the robot of a case, drawn."""

    family: str
    nominal: Nested
    deviations: Deviations
    sensors: SensorSet

    def drive(self, hidden: Sequence[Hidden], mission: _Mission) -> Track:
        """The real robot with these effects concealed in it."""
        real = real_parameters(self.nominal, self.deviations, hidden)
        return track_of(real, hidden, mission.commands, mission.seed)

    def simulate(self, mission: _Mission) -> Track:
        """The robot as it is believed to be."""
        return track_of(flat(self.nominal), (), mission.commands, mission.seed)


def make_case(job: Job) -> None:
    """Make one case; its truth is written last and stands for a complete case."""
    case = job.case
    entropy = int(case.identity(job.seed), 16)
    streams = [np.random.default_rng(seed) for seed in _spawned(job.seed, entropy, 6)]
    robot = _drawn_robot(case, streams[0], streams[1])
    real, holdout = (
        _drawn_mission(case, robot.nominal, length, streams[2])
        for length in (REAL_SECONDS, HOLDOUT_SECONDS)
    )
    hidden = [hidden_of(item, robot.nominal, streams[3]) for item in case.effects]
    if case.balanced:
        hidden = _balanced(robot, hidden, real)
    shutil.rmtree(job.folder, ignore_errors=True)
    job.folder.mkdir(parents=True)
    text = description_text(case, robot.nominal)
    (job.folder / "robot.yaml").write_text(text, encoding="utf-8")
    truth = _described(case, job, robot, hidden) | {
        "durations_s": [round(float(mission.commands[0][-1]), 2) for mission in (real, holdout)],
        **_recorded(job.folder, robot, hidden, (real, holdout), streams[4]),
    }
    job.truth.parent.mkdir(parents=True, exist_ok=True)
    partial = job.truth.with_suffix(".part")
    partial.write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    partial.rename(job.truth)


def _spawned(seed: int, entropy: int, count: int) -> list[np.random.SeedSequence]:
    return np.random.SeedSequence([seed, entropy]).spawn(count)


def _drawn_robot(case: Case, body: np.random.Generator, sensing: np.random.Generator) -> _Robot:
    family, nominal = described(case, body)
    deviations = drawn_deviations(nominal, body)
    gear = float(nominal["motor"]["gear_ratio"])
    sensors = drawn_sensors(FAMILIES[family], gear, case.noise, not case.total_only, sensing)
    return _Robot(family, nominal, deviations, sensors)


def _drawn_mission(
    case: Case,
    nominal: Nested,
    length: tuple[float, float],
    random: np.random.Generator,
) -> _Mission:
    plan = random_plan(case.style, nominal, float(random.uniform(*length)), random)
    seed = int(random.integers(2**31))
    start = int(random.integers(_FIRST_START_S, _LAST_START_S)) * NANOSECONDS
    start += int(random.integers(NANOSECONDS))
    return _Mission(commands_of(plan), seed, start)


def _balanced(robot: _Robot, hidden: Sequence[Hidden], mission: _Mission) -> list[Hidden]:
    """Scale the second effect until both leave the mean motor power as it was.

    Taken as linear: twice as much of an effect shifts the mean twice as far.
    """
    none = robot.drive((), mission)
    first, second = (oracle.mean_shift(robot.drive([item], mission), none) for item in hidden)
    factor = min(abs(first / second), _LARGEST_BALANCE) * -np.sign(first * second)
    # What has less to lose than the first effect draws gets a smaller first effect.
    share = min(1.0, _LARGEST_LOSS / abs(factor * hidden[1].size))
    return [
        rescaled(hidden[0], share) if share < 1.0 else hidden[0],
        rescaled(hidden[1], float(share * factor)),
    ]


def _recorded(
    folder: Path,
    robot: _Robot,
    hidden: Sequence[Hidden],
    missions: tuple[_Mission, _Mission],
    random: np.random.Generator,
) -> dict[str, Any]:
    """Drive and record both missions; what the oracle makes of them."""
    found: dict[str, Any] = {}
    for name, mission in zip(("real", "real_holdout"), missions, strict=True):
        true = robot.drive(hidden, mission)
        nominal = robot.simulate(mission)
        readings = write_recording(folder / name, true, robot.sensors, mission.start_ns, random)
        found[name] = oracle.errors(readings, nominal, true)
        if name == "real":
            ideal = SensorSet(imu=robot.sensors.imu, wheel_power=robot.sensors.wheel_power)
            write_recording(folder / "sim", nominal, ideal, mission.start_ns, random)
            others = [
                robot.drive([*hidden[:i], *hidden[i + 1 :]], mission) for i in range(len(hidden))
            ]
            voltage = robot.nominal["supply"]["nominal_voltage"]
            found[name] |= oracle.visibility(true, others, robot.sensors, voltage)
    return {"barely_excited": oracle.barely_excited(found["real"]), "oracle": found}


def _described(case: Case, job: Job, robot: _Robot, hidden: Sequence[Hidden]) -> dict[str, Any]:
    sensors = robot.sensors
    return {
        "id": job.identity,
        "name": case.name,
        "group": case.group,
        "kind": case.letters,
        "family": robot.family,
        "null": not hidden,
        "total_only": case.total_only,
        "effects": truth_of(hidden, robot.nominal, robot.deviations),
        "nominal": robot.nominal,
        "deviations": robot.deviations,
        "encoder_counts_per_rev": round(2.0 * np.pi / sensors.encoder_resolution),
        "sensor_noise": {
            "sigma_v": sensors.voltage_noise,
            "sigma_i": sensors.current_noise,
            "lsb_i": sensors.current_resolution,
            "kind": sensors.noise,
            "correlation_time_s": sensors.correlation_time,
        },
        "mission": [case.style, case.style],
    }


def make_all(cases: Sequence[Case], seed: int, out: Path, jobs: int) -> list[str]:
    """Make what is not there yet, side by side; returns one line for every case that failed."""
    todo = [job for job in (Job(case, seed, out) for case in cases) if not job.truth.exists()]
    failed: list[str] = []
    if not todo:
        return failed
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(jobs) as pool:
        running = {pool.submit(make_case, job): job for job in todo}
        for done in tqdm(as_completed(running), total=len(todo), desc="cases", unit="case"):
            error = done.exception()
            if error is not None:
                job = running[done]
                failed.append(f"{job.identity} ({job.case.name}): {error}")
    return failed


def chosen(
    cases: Sequence[Case], seed: int, only: Sequence[str], groups: Sequence[str]
) -> Iterator[Case]:
    """Cases by name or identity, and by group; all of them if neither is given."""
    for case in cases:
        by_name = case.name in only or case.identity(seed) in only
        by_group = case.group in groups or (case.quick and "small" in groups)
        if by_name or by_group or not (only or groups):
            yield case
