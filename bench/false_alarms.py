"""False alarms of the shipped classifier in many hours of healthy driving in the planar model.

    .venv/bin/python bench/false_alarms.py [--hours 20]

`bench/diagnosis.py` counts them in MuJoCo, where three hours take twenty minutes and cannot
distinguish one alarm in ten hours from none. Here the drives are as there, bumps, starts and stops
included, from seeds that nothing else uses; the plant is the faster one that also trains.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np
from pool import each

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import FAULTLESS
from tomr_fault_diag.diagnosis.score import poisson_interval
from tomr_fault_diag.residuals.frame import SPEEDS, Residual, ResidualFrame, Unit
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.cli import run_main
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import random_drive
from tomr_training.planar.generate import IGNORED, simulate

_FIRST_SEED = 40_000_000
_PERIOD = 50_000_000  # ns
_UNITS: list[Unit] = ["rad/s" if channel in SPEEDS else "W" for channel in range(10)]


def alarms(seed: int) -> tuple[list[str], int, int]:
    """Faults named in a drive, those where a wheel did slip, and ticks."""
    drawn = random_drive(shipped_robot("reference"), seed, None)
    drive, robot = simulate(drawn), drawn.believed
    values = np.stack([*drive.compared.residuals(BandSettings()), drive.compared.modelled])
    classifier = FaultClassifier.of(ClassifierSettings(), robot)
    found: list[str] = []
    slipped = 0
    for tick, rows in enumerate(values.transpose(1, 2, 0).tolist()):
        residuals = tuple(
            Residual(residual, band, modelled, unit)
            for (residual, band, modelled), unit in zip(rows, _UNITS, strict=True)
        )
        diagnosis = classifier.classify(ResidualFrame((tick + 1) * _PERIOD, residuals))
        if diagnosis and diagnosis.changed and diagnosis.state.name not in FAULTLESS:
            if (drive.labels[max(0, tick - 10) : tick + 1] == IGNORED).any():
                slipped += 1
            else:
                found.append(diagnosis.state.name)
    return found, slipped, len(drive.labels)


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=20.0)
    options = parser.parse_args(arguments)
    count = max(1, round(options.hours * 3600.0 / 18.0))
    seeds = range(_FIRST_SEED, _FIRST_SEED + count)
    parts = each(alarms, seeds, at_a_time=20)
    kinds = Counter(name for found, _, _ in parts for name in found)
    hours = sum(ticks for _, _, ticks in parts) * 0.05 / 3600.0
    total = sum(kinds.values())
    low, high = poisson_interval(total)
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
