"""False alarms of the shipped classifier in many hours of healthy driving in the planar model.

    .venv/bin/python bench/false_alarms.py [--hours 20]

`bench/diagnosis.py` counts them in MuJoCo, where three hours take twenty minutes and cannot tell
one alarm in ten hours from none. Here the drives are as there, bumps, starts and stops included,
from seeds that nothing else uses; the plant is the faster one that also trains.
"""

import argparse
import json
import os
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from scipy.stats import chi2
from tqdm import tqdm

from tomr_fault_diag.classifier.judges import make_judge
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import FAULTLESS
from tomr_fault_diag.residuals.frame import SPEEDS, Residual, ResidualFrame, Unit
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.training.drives import random_drive
from tomr_fault_diag.training.planar.generate import UNTOLD, simulate
from tomr_power_model.cli import run_main
from tomr_power_model.robot import shipped_robot

_FIRST_SEED = 40_000_000
_BATCH = 300
_PERIOD = 50_000_000  # ns
_UNITS: list[Unit] = ["rad/s" if channel in SPEEDS else "W" for channel in range(10)]


def alarms(first: int) -> tuple[list[str], int, int]:
    """Faults named in a batch of drives, those where a wheel did slip, and ticks."""
    reference = shipped_robot("reference")
    batch = simulate([random_drive(reference, seed, None) for seed in range(first, first + _BATCH)])
    values = np.stack([*batch.compared.residuals(BandSettings()), batch.compared.modelled])
    found: list[str] = []
    slipped, ticks = 0, 0
    for column in range(_BATCH):
        classifier = FaultClassifier(make_judge(ClassifierSettings()))
        length = int(np.flatnonzero(batch.labels[:, column] != UNTOLD)[-1]) + 1
        ticks += length
        for tick, rows in enumerate(values[:, :length, :, column].transpose(1, 2, 0).tolist()):
            residuals = tuple(
                Residual(residual, band, modelled, unit)
                for (residual, band, modelled), unit in zip(rows, _UNITS, strict=True)
            )
            diagnosis = classifier.classify(ResidualFrame((tick + 1) * _PERIOD, residuals))
            if diagnosis and diagnosis.changed and diagnosis.state.name not in FAULTLESS:
                recent = batch.labels[max(0, tick - 10) : tick + 1, column]
                if (recent == UNTOLD).any():
                    slipped += 1
                else:
                    found.append(diagnosis.state.name)
    return found, slipped, ticks


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=20.0)
    options = parser.parse_args(arguments)
    count = max(1, round(options.hours * 3600.0 / 18.0 / _BATCH))
    firsts = [_FIRST_SEED + _BATCH * batch for batch in range(count)]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        parts = list(tqdm(pool.map(alarms, firsts), total=count, unit="batch"))
    kinds = Counter(name for found, _, _ in parts for name in found)
    hours = sum(ticks for _, _, ticks in parts) * 0.05 / 3600.0
    total = sum(kinds.values())
    low = float(chi2.ppf(0.025, 2 * total)) / 2.0 if total else 0.0
    high = float(chi2.ppf(0.975, 2 * total + 2)) / 2.0
    report = {
        "hours": round(hours, 2),
        "false_alarms": dict(kinds),
        "slip_named_where_a_wheel_slipped": sum(slipped for _, slipped, _ in parts),
        "per_10_hours": round(10.0 * total / hours, 3),
        "ci95_per_10_hours": [round(10.0 * low / hours, 3), round(10.0 * high / hours, 3)],
    }
    print(json.dumps(report, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
