"""The planar model that trains the classifier against MuJoCo, on the same drives.

    .venv/bin/python bench/planar.py [--drives 12]

For healthy drives and each kind of fault, while it is in force: root mean square of the residuals
in either simulation, and their correlation tick by tick. Sensor noise is drawn apart in the two.
"""

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pool import each
from stages import as_arrays

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.cli import run_main
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import KINDS, random_drive
from tomr_training.planar.generate import simulate
from tomr_training.simulated_drive import simulated_drive

Array = NDArray[np.float64]
_FIRST_SEED = 600_000
_GROUPS = {"total power": [0], "motor powers": [1, 2, 3], "wheel speeds": [4, 5, 6]}


def both(seed: int, kind: str | None) -> tuple[Array, Array]:
    """Residuals (ticks, 10) in MuJoCo and in the planar model, while the fault is in force."""
    drive = random_drive(shipped_robot("reference"), seed, kind)
    labelled = simulated_drive(drive)
    planar, _ = simulate(drive).compared.residuals(BandSettings())
    residual, _ = as_arrays(labelled.frames)
    ticks = labelled.first - 1 + np.arange(len(residual))
    chosen = (ticks < len(planar)) & (labelled.faulty if kind else True)
    return residual[chosen], planar[ticks[chosen]]


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=12, help="of each kind (default 12)")
    options = parser.parse_args(arguments)
    kinds = [kind for kind, _ in KINDS]
    work = [(_FIRST_SEED + number, kind) for kind in kinds for number in range(options.drives)]
    found = each(both, *zip(*work, strict=True))
    print(f"{'':22}{'residual':14}{'MuJoCo':>9}{'planar':>9}{'correlation':>13}")
    for kind in kinds:
        parts = [pair for pair, (_, of) in zip(found, work, strict=True) if of == kind]
        mujoco, planar = (np.concatenate(side) for side in zip(*parts, strict=True))
        for name, channels in _GROUPS.items():
            a, b = mujoco[:, channels].ravel(), planar[:, channels].ravel()
            known = np.isfinite(a) & np.isfinite(b)
            sizes = [float(np.sqrt(np.mean(side[known] ** 2))) for side in (a, b)]
            alike = float(np.corrcoef(a[known], b[known])[0, 1])
            title = kind or "healthy"
            print(f"{title:22}{name:14}{sizes[0]:9.3f}{sizes[1]:9.3f}{alike:13.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
