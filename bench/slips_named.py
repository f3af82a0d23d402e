"""How much of the time in which wheels slide the diagnosis names a slip: with a gyro and without.

    .venv/bin/python bench/slips_named.py --robot robot_explained.yaml

The recordings slips_practice (under $TOMR_RECORDINGS) through the pipeline of the nodes, their gyro
heard and left out; ROBOT is what `bench/faults_practice.py explain` makes of the same robot. A
wheel slides where the truth beside the drives says so. A name within 1.5 s of a slide is its
own; `other` is the share of the remaining time with any fault named, but for that of a power
sensor in the drive that lacks one: rollers that drag, pushes and slopes beyond the description.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import astuple, evolve, frozen
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from stages import pipeline_of, steps_of
from tqdm import tqdm

from tomr_fault_diag.classifier.states import FAULTLESS, POWER_SENSOR, SLIP, STATES
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.model.ticks import NANOSECONDS

Mask = NDArray[np.bool_]

_AFTER = 1.5  # s in which a slip that is over may still be named
_SLIP = STATES[SLIP].name


@frozen
class Named:
    """Ticks of a drive: in how many wheels slid, a slip was named, and a fault for no reason."""

    sliding: int
    named: int
    slides: int  # of at least 0.2 s
    unseen: int  # of them, never named
    gripping: int
    accused: int


def _within(seconds: NDArray[np.float64], spans: list[list[float]], after: float) -> Mask:
    inside = np.zeros(len(seconds), dtype=bool)
    for begin, end in spans:
        inside |= (seconds >= begin) & (seconds < end + after)
    return inside


def _judged(bag: Path, truth: dict[str, Any], pipeline: Pipeline) -> Named:
    times, states = [], []
    state = ""
    for _, step in steps_of(bag, pipeline):
        named = {diagnosis.stamp_ns: diagnosis.state.name for diagnosis in step.diagnoses}
        for frame in step.frames:
            state = named.get(frame.stamp_ns, state)
            times.append((frame.stamp_ns - int(truth["t0_ns"])) / NANOSECONDS)
            states.append(state)
    seconds, spans = np.array(times), truth["in_use"]
    blind = POWER_SENSOR[0].name[:-2] if truth["power_missing"] else "-"
    slip = np.array([name == _SLIP for name in states])
    faultless = FAULTLESS | {""}
    fault = np.array([name not in faultless and not name.startswith(blind) for name in states])
    sliding = _within(seconds, spans, 0.0)
    gripping = ~_within(seconds, spans, _AFTER)
    if truth["lift"]:
        gripping &= ~_within(seconds, [truth["lift"]["interval"]], _AFTER)
    long = [(begin, end) for begin, end in spans if end - begin >= 0.2]
    seen = [bool((slip & _within(seconds, [[begin, end]], _AFTER)).any()) for begin, end in long]
    return Named(
        int(sliding.sum()),
        int((sliding & slip).sum()),
        len(long),
        len(long) - sum(seen),
        int(gripping.sum()),
        int((gripping & fault).sum()),
    )


def _row(name: str, kind: str, found: Named) -> tuple[str, ...]:
    return (
        name,
        kind,
        f"{found.sliding / 20:.1f}",
        f"{found.named / found.sliding:.1%}" if found.sliding else "-",
        f"{found.unseen} of {found.slides}",
        f"{found.accused / max(found.gripping, 1):.2%}",
    )


def _sum(parts: Sequence[Named]) -> Named:
    return Named(*map(sum, zip(*map(astuple, parts), strict=True)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", type=Path, required=True, help="its explained description")
    options = parser.parse_args(arguments)
    root = Path(os.environ.get("TOMR_RECORDINGS", "../shared/recordings")) / "slips_practice"
    if not root.is_dir():
        raise InputError(f"{root}: no such recordings: set TOMR_RECORDINGS")
    table = Table("drive", "kind", "s of sliding", "named slip", "never named", "other")
    parts: dict[str, list[Named]] = {}
    base = pipeline_of(options.robot)
    for file in tqdm(sorted((root / "slips_truth/practice").glob("*.json")), disable=None):
        truth = json.loads(file.read_text(encoding="utf-8"))
        for heard in (True, False) if truth["imu"] else (False,):
            residuals = evolve(base.settings.residuals, watch_gyro=heard, watch_accelerometer=heard)
            pipeline = Pipeline(base.robot, evolve(base.settings, residuals=residuals))
            bag = root / "slips/practice" / truth["set"] / truth["id"]
            found = _judged(bag, truth, pipeline)
            kind = "IMU" if heard else ("its IMU left out" if truth["imu"] else "no IMU")
            parts.setdefault(kind, []).append(found)
            table.add_row(*_row(truth["id"], f"{truth['kind']}, {kind}", found))
    for kind, several in parts.items():
        table.add_row(*_row("all", kind, _sum(several)))
    Console(width=110).print(table)
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(main))
