"""The diagnosis against simulated drives that training never saw.

    .venv/bin/python bench/diagnosis.py [--drives 400] [--healthy-hours 3]

Drives come from MuJoCo: missions, headings, robots, parameter deviations, noise, floors, fault
kinds, wheels, severities and onsets drawn at random from seeds far from those of training. What is
scored is the state on /diagnostics at each tick, filter in time included. A tick at which nobody
could tell (the faulty wheel idle, nothing slipping, no residual outside its band) or in the first
second after an onset or an end is left out of the confusion; onsets are scored by their delay.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from scipy.stats import beta
from tqdm import tqdm

from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP, STATES
from tomr_fault_diag.training.collect import watch
from tomr_fault_diag.training.drives import Drive, random_drive
from tomr_fault_diag.training.labels import Truth, label_of
from tomr_power_model.cli import run_main
from tomr_power_model.robot import shipped_robot

FIRST_SEED = 1_000_000  # of faulty drives; healthy ones follow at twice that
_GRACE = 1_000_000_000  # ns


@frozen
class Outcome:
    """One drive as it was diagnosed."""

    seconds: float
    confusion: tuple[tuple[int, int], ...]  # (true, named) of each tick that counts
    delay: float | None  # s from the first tick that shows the fault; None: never named
    shown: bool  # whether the fault ever showed
    severity: float
    alarms: int  # faults named in a healthy drive


def _true_state(truth: Truth) -> int:
    if truth.fault is None:
        return NORMAL
    if truth.fault == "floor_slippery":
        return SLIP
    return CONTROL if truth.fault == "control_signal_lost" else MOTOR + truth.wheel


def score(drive: Drive) -> Outcome:
    """Drive, diagnose, and hold the states against the truth."""
    watched = watch(drive)
    classifier = FaultClassifier(Network.load())
    named, state = [], NORMAL
    for frame in watched.frames:
        diagnosis = classifier.classify(frame)
        if diagnosis is not None and diagnosis.state in STATES:
            state = STATES.index(diagnosis.state)
        named.append(state)
    pairs: list[tuple[int, int]] = []
    healthy_since, shown_since, delay = 0, None, None
    last, changed = NORMAL, 0
    for frame, truth, name in zip(watched.frames, watched.truths, named, strict=True):
        true = NORMAL if truth is None else _true_state(truth)
        if true != last:
            last, changed = true, frame.stamp_ns
        healthy_since = frame.stamp_ns if true != NORMAL else healthy_since
        label = label_of(frame, truth, healthy_since)
        if label not in (None, NORMAL):
            shown_since = shown_since or frame.stamp_ns
            if name == label and delay is None:
                delay = 1e-9 * (frame.stamp_ns - shown_since)
        recovering = true == NORMAL and frame.stamp_ns - healthy_since < 3 * _GRACE
        late = shown_since is not None and frame.stamp_ns - shown_since < _GRACE
        if label is not None and not late and not recovering and frame.stamp_ns - changed > _GRACE:
            pairs.append((label, name))
    faults = drive.mission.faults
    rises = np.diff([int(name != NORMAL) for name in [NORMAL, *named]])
    return Outcome(
        seconds=0.05 * len(named),
        confusion=tuple(pairs),
        delay=delay,
        shown=shown_since is not None,
        severity=float(faults[0].settings["severity"]) if faults else 0.0,  # type: ignore[arg-type]
        alarms=int((rises == 1).sum()) if not faults else 0,
    )


def faulty(seed: int) -> Outcome:
    """A drive with a fault."""
    while not (drive := random_drive(shipped_robot("reference"), seed)).mission.faults:
        seed += 10_000_000
    return score(drive)


def healthy(seed: int) -> Outcome:
    """A drive without one."""
    drive = random_drive(shipped_robot("reference"), 2 * FIRST_SEED + seed)
    return score(evolve(drive, mission=evolve(drive.mission, faults=())))


def report(sick: Sequence[Outcome], well: Sequence[Outcome]) -> dict[str, object]:
    """Confusion, recall, precision, delays, false alarms with their interval."""
    confusion = np.zeros((len(STATES), len(STATES)), dtype=int)
    for outcome in (*sick, *well):
        for true, name in outcome.confusion:
            confusion[true, name] += 1
    right, total = int(np.trace(confusion)), int(confusion.sum())
    shown = [outcome for outcome in sick if outcome.shown]
    delays = [outcome.delay for outcome in shown if outcome.delay is not None]
    hours = sum(outcome.seconds for outcome in well) / 3600.0
    alarms = sum(outcome.alarms for outcome in well)
    by_drive = np.array(
        [[sum(t == n for t, n in o.confusion), len(o.confusion)] for o in (*sick, *well)]
    )
    random = np.random.default_rng(0)
    resampled = by_drive[random.integers(0, len(by_drive), (2000, len(by_drive)))].sum(axis=1)
    low, high = np.percentile(resampled[:, 0] / resampled[:, 1], [2.5, 97.5])
    return {
        "drives": {"faulty": len(sick), "fault_showed": len(shown), "healthy": len(well)},
        "accuracy_of_decisions": right / total,
        "accuracy_ci95_by_drive": [float(low), float(high)],
        "states": [state.name for state in STATES],
        "confusion_rows_true": confusion.tolist(),
        "recall": (np.diag(confusion) / np.maximum(confusion.sum(axis=1), 1)).round(4).tolist(),
        "precision": (np.diag(confusion) / np.maximum(confusion.sum(axis=0), 1)).round(4).tolist(),
        "faults_never_named": len(shown) - len(delays),
        "delay_s": {
            "median": float(np.median(delays)),
            "p95": float(np.percentile(delays, 95)),
        },
        "false_alarms": alarms,
        "healthy_hours": hours,
        "false_alarms_per_hour": alarms / hours,
        "false_alarm_drives_share_ci95_high": float(
            beta.ppf(0.975, sum(o.alarms > 0 for o in well) + 1, len(well))
        ),
    }


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=400)
    parser.add_argument("--healthy-hours", type=float, default=3.0)
    parser.add_argument("--json", type=Path, help="write the report to this file as well")
    options = parser.parse_args(arguments)
    count = max(1, round(options.healthy_hours * 3600.0 / 18.5))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        seeds = range(FIRST_SEED, FIRST_SEED + options.drives)
        sick = list(tqdm(pool.map(faulty, seeds), total=options.drives, desc="faulty"))
        well = list(tqdm(pool.map(healthy, range(count)), total=count, desc="healthy"))
    text = json.dumps(report(sick, well), indent=2)
    print(text)
    if options.json:
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
