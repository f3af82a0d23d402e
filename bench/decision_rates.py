"""The same drives at several rates and phases of decisions: the states must not depend on them.

    .venv/bin/python bench/decision_rates.py [--rates 5 10 20 50 100] [--phases 4]

Phases are shifts of all stamps, by parts of the period at 20 Hz. For each drive the sequences of
states are listed with how often they came, and when each change came, first to last.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import product

import numpy as np
from disturbances import stamped
from interrupted import recorded
from pool import each

from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import shipped_robot

MISSIONS = (
    "circle_encoder_lost", "circle_control_signal_lost", "circle_floor_slippery", "random_tour",
)  # fmt: skip
Changes = tuple[tuple[float, str], ...]  # s after the start, state
_PERIOD = 0.05  # s


def changes(mission: str, hz: float, shift: float) -> Changes:
    """States that a drive is given, and when; its stamps shifted [s]."""
    settings = DiagnosisSettings.of({"decision_rate": hz}, "here")
    pipeline = Pipeline(shipped_robot("reference"), settings)
    drive = recorded(mission, 100)
    found = []
    for item in drive:
        moved = stamped(item, item.stamp_ns + to_ns(shift))
        step = pipeline.take(moved.topic, moved.message, moved.stamp_ns)
        found += [
            (1e-9 * (d.stamp_ns - drive[0].stamp_ns) - shift, d.state.name)
            for d in step.diagnoses
            if d.changed
        ]
    return tuple(found)


def main(arguments: Sequence[str] | None) -> int:
    """Play all; a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rates", type=float, nargs="+", default=[5.0, 10.0, 20.0, 50.0, 100.0])
    parser.add_argument("--phases", type=int, default=4)
    parser.add_argument("--missions", nargs="+", default=MISSIONS)
    parser.add_argument("--jobs", type=int, help="processes (default: one a core)")
    options = parser.parse_args(arguments)
    shifts = [_PERIOD * k / options.phases for k in range(options.phases)]
    for mission in options.missions:
        recorded(mission, 100)  # the workers inherit it
        cases = list(product(options.rates, shifts))
        columns = zip(*[(mission, *case) for case in cases], strict=True)
        found = each(changes, *columns, title=mission, jobs=options.jobs)
        print(mission)
        for names, count in Counter(tuple(n for _, n in c) for c in found).most_common():
            same = [c for c in found if tuple(n for _, n in c) == names]
            times = np.array([[at for at, _ in c] for c in same])
            spans = [
                f"{name} {low:.2f}..{high:.2f} s"
                for name, low, high in zip(names, times.min(axis=0), times.max(axis=0), strict=True)
            ]
            rates = sorted({hz for (hz, _), c in zip(cases, found, strict=True) if c in same})
            print(f"  {count} of {len(cases)} at {rates} Hz: {'; '.join(spans)}")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(main))
