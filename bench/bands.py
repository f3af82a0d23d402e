"""Bands that hold 99.9 % of the residuals of healthy driving.

    .venv/bin/python bench/bands.py                          # the defaults of power_residuals
    .venv/bin/python bench/bands.py BAG... --robot my.yaml   # of one robot, from its healthy drives

Without recordings: random robots up to 5 % off their description, payloads included, in the planar
model that trains the classifier, and the shares of residuals outside the shipped and the paper's
bands. With recordings: a section for robot.yaml.
"""

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import yaml
from attrs import asdict, evolve
from numpy.typing import NDArray
from stages import as_arrays, pipeline_of, steps_of

from tomr_fault_diag.classifier.states import NORMAL
from tomr_fault_diag.residuals.calibrated import fit_bands
from tomr_fault_diag.residuals.settings import PAPER_BANDS, BandSettings
from tomr_fault_diag.residuals.widths import moved
from tomr_power_model.cli import run_main
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import random_drive
from tomr_training.labels import LATELY
from tomr_training.planar.generate import simulate

Array = NDArray[np.float64]
_FIRST_SEED = 30_000_000
_KINDS = {
    "total": slice(0, 1),
    "motors": slice(1, 4),
    "speeds": slice(4, 7),
    "derived": slice(7, 10),
}


def simulated(count: int) -> None:
    """Fit to healthy simulated drives without bumps, and hold the bands against each other."""
    reference = shipped_robot("reference")
    seeds = range(_FIRST_SEED, _FIRST_SEED + count)
    drives = [evolve(random_drive(reference, seed, None), bumps=()) for seed in seeds]
    simulated = [simulate(drive) for drive in drives]
    kept = [(drive.labels == NORMAL) & (np.arange(len(drive.labels)) > 0) for drive in simulated]

    def joined(parts: Iterable[Array]) -> Array:
        return np.concatenate([part[rows] for part, rows in zip(parts, kept, strict=True)])

    modelled = [drive.compared.modelled for drive in simulated]
    residual = joined(drive.compared.residuals(BandSettings())[0] for drive in simulated)
    fitted = fit_bands(residual, joined(modelled), joined(moved(each, LATELY) for each in modelled))
    print(yaml.safe_dump({"fitted": rounded(fitted)}, sort_keys=False))
    for name, bands in (("fitted", fitted), ("shipped", BandSettings()), ("paper", PAPER_BANDS)):
        band = joined(drive.compared.residuals(bands)[1] for drive in simulated)
        outside = np.abs(residual) > band
        shares = ", ".join(
            f"{kind} {100 * outside[:, s].mean():.2f} %" for kind, s in _KINDS.items()
        )
        print(f"outside the {name} bands: {shares}")


def recorded(bags: Sequence[Path], robot: str) -> None:
    """Fit to the residuals of healthy recordings of one robot."""
    parts: list[tuple[Array, Array, Array]] = []
    unit = "W"
    for bag in bags:
        frames = [frame for _, step in steps_of(bag, pipeline_of(robot)) for frame in step.frames]
        residual, modelled = as_arrays(frames)
        parts.append((residual, modelled, moved(modelled, LATELY)))
        unit = next((f.residuals[1].unit for f in frames if not f.residuals[1].stale), unit)
    first, second, third = (np.concatenate(column) for column in zip(*parts, strict=True))
    bands = rounded(fit_bands(first, second, third, unit))
    section = {"power_residuals": {"ros__parameters": {"band": bands}}}
    print(yaml.safe_dump(section, sort_keys=False))


def rounded(bands: BandSettings) -> dict[str, float]:
    """Numbers to read."""
    return {name: float(f"{value:.3g}") for name, value in asdict(bands).items()}


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bags", type=Path, nargs="*", help="healthy recordings of one robot")
    parser.add_argument("--robot", default="reference", help="shipped name or robot.yaml")
    parser.add_argument("--drives", type=int, default=300, help="to simulate (default 300)")
    options = parser.parse_args(arguments)
    if options.bags:
        recorded(options.bags, options.robot)
    else:
        simulated(options.drives)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
