"""Wang 2024, Table 1 against simulated faults: which inputs are speeds, which are powers?

    .venv/bin/python bench/table1.py

The text lists the encoder-derived power residuals as inputs 5-7 and the speed residuals as 8-10;
the rows of the table read the other way round. Drives the faults of section 3, takes the codes of
Eq. 21 in each instant in which a fault shows, and counts how often they are those of the table
under either order.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from attrs import frozen
from figures.simulated import SENSOR_BANDS
from numpy.typing import NDArray
from pool import each
from wang2024 import record

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ENCODERS, INPUT_ORDERS, MOTORS, SPEEDS, TOTAL
from tomr_power_model.cli import run_main
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot

Codes = NDArray[np.int64]

# The columns of Table 1: inputs 1-10 and the state they stand for.
TABLE: dict[str, tuple[int, ...]] = {
    "slip": (-1, -1, -1, 0, 0, 0, 0, -1, -1, 0),
    "control system fault": (-1, -1, 0, 0, -1, 0, 0, 0, 0, 0),
    "motor system fault 1": (1, 1, 0, 0, -1, 0, 0, 1, 0, 0),
    "motor system fault 2": (1, 0, 1, 0, 0, -1, 0, 0, 1, 0),
    "motor system fault 3": (1, 0, 0, 1, 0, 0, -1, 0, 0, 1),
}
DISPUTED = slice(4, 10)


@frozen
class Case:
    """A faulty drive and the column that is meant for it; the fault lasts from .. to [s]."""

    state: str
    mission: str
    since: float
    until: float


CASES = (
    Case("control system fault", "paper_phases_control_signal_lost", 1.0, 26.0),
    Case("motor system fault 1", "paper_phases_encoder_lost", 1.0, 26.0),
    Case("motor system fault 2", "square_encoder_lost", 9.5, 12.0),
    Case("motor system fault 3", "circle_encoder_lost", 8.0, 14.0),
    Case("slip", "paper_phases_floor_slippery", 1.0, 26.0),
)


def codes_of(bag: Path, case: Case) -> Codes:
    """Codes (n, 10) in the order of our frame, of the ticks in which the fault shows."""
    pipeline = Pipeline(load_robot("reference"), DiagnosisSettings.of(SENSOR_BANDS, "bench"))
    found = []
    with open_recording(bag) as recording:
        for _, step in diagnose(recording, pipeline):
            for frame in step.frames:
                at = 1e-9 * (frame.stamp_ns - recording.start_ns)
                if case.since < at <= case.until and any(frame.codes):
                    found.append(frame.codes)
    return np.array(found, dtype=np.int64).reshape(-1, 10)


def agreement(codes: Codes, state: str) -> dict[str, object]:
    """How a fault's codes compare with its column under either order."""
    column = np.array(TABLE[state])
    report: dict[str, object] = {
        "ticks": len(codes),
        "mean_code": {
            "total": round(float(codes[:, TOTAL].mean()), 3),
            "motors": codes[:, list(MOTORS)].mean(axis=0).round(3).tolist(),
            "speeds": codes[:, list(SPEEDS)].mean(axis=0).round(3).tolist(),
            "against_encoders": codes[:, list(ENCODERS)].mean(axis=0).round(3).tolist(),
        },
    }
    for name, order in INPUT_ORDERS.items():
        same = codes[:, list(order)] == column
        signed = column[DISPUTED] != 0
        report[name] = {
            "disputed_inputs_as_printed": float(same[:, DISPUTED].mean()),
            "of_them_where_the_table_has_a_sign": float(same[:, DISPUTED][:, signed].mean()),
            "whole_column_as_printed": float(same.all(axis=1).mean()),
        }
    return report


def _main(arguments: Sequence[str] | None) -> int:
    argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0]).parse_args(arguments)
    planned = [(case.mission, 1) for case in CASES]
    with TemporaryDirectory() as name:
        make = partial(record, deviation=0.0, deviation_seed=0, folder=Path(name))
        bags = each(make, planned, title="driving")
        found = each(codes_of, bags, CASES, title="diagnosing")
    report = {
        f"{case.state} ({case.mission})": agreement(codes, case.state)
        for case, codes in zip(CASES, found, strict=True)
    }
    print(json.dumps(report, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
