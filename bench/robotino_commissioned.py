"""The real Robotino, commissioned: healthy drives in which a fault is named.

    .venv/bin/python bench/robotino_commissioned.py --out commissioned [--surface gray]

Commissions the shipped description, which knows the bench only, on every third heading of a floor,
and plays all other headings of that floor, and all of the others, through the three stages. The
brown floor is a data set of its own, robotino_brown beside the other; it is played if it is there.
"""

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, process_time
from typing import Any

from pool import each
from robotino import is_absent, play, report

from tomr_commission.cli import main as commission
from tomr_fault_diag.diagnosis.score import binomial_interval
from tomr_power_model.cli import run_main
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.dataset import default_dataset

_THIRD = 15  # degrees: headings are 5 apart
_SURFACES = ("gray", "green")


def divided(bags: Path, surface: str) -> tuple[list[Path], list[Path]]:
    """Recordings at every third heading of a surface, and those at the others."""
    with (bags / "index.csv").open(encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if row["surface"] == surface]
    of_third = [round(float(row["heading_deg"])) % _THIRD == 0 for row in rows]
    paths = [bags / row["bag"] for row in rows]
    return (
        [path for path, is_in in zip(paths, of_third, strict=True) if is_in],
        [path for path, is_in in zip(paths, of_third, strict=True) if not is_in],
    )


def alarmed(bags: Sequence[Path], robot: Path) -> dict[str, Any]:
    """Drives in which a fault is named, with the interval of their share, and all states."""
    found = report(each(partial(play, robot=str(robot)), bags))
    part = found["drives_with_a_fault_named"]
    assert isinstance(part, int)
    return {
        "drives": len(bags),
        "drives_with_a_fault_named": part,
        "share_ci95": binomial_interval(part, len(bags)),
        "states": found["states"],
    }


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--surface", choices=_SURFACES, default="gray")
    parser.add_argument("--dataset", type=Path, default=default_dataset())
    parser.add_argument("--robot", default="robotino_v2", help="shipped name or robot.yaml")
    parser.add_argument("--out", type=Path, required=True, help="of tomr_commission")
    options = parser.parse_args(arguments)
    if is_absent(options.dataset):
        return 0
    with TemporaryDirectory() as folder:
        bags = Path(folder) / "bags"
        given = [str(options.dataset), "--out", str(bags), "--surface", *_SURFACES]
        begun, used = monotonic(), process_time()
        with redirect_stdout(sys.stderr):
            import_robotino(given)
            fitted, _ = divided(bags, options.surface)
            named = ["--robot", options.robot, "--out", str(options.out)]
            code = commission([*map(str, fitted), *named, "--tolerance", "0.05"])
        found: dict[str, Any] = {
            "commissioned_on": f"{len(fitted)} drives, {options.surface}",
            "exit_code": code,
            "seconds": round(monotonic() - begun),
            "cpu_seconds_of_one_process": round(process_time() - used),
        }
        robot = options.out / "commissioned.yaml"
        for surface in _SURFACES:
            third, rest = divided(bags, surface)
            unseen = rest if surface == options.surface else [*third, *rest]
            found[surface] = alarmed(unseen, robot)
        beside = options.dataset.with_name("robotino_brown")
        if beside.exists():
            more = Path(folder) / "beside"
            with redirect_stdout(sys.stderr):
                import_robotino([str(beside), "--out", str(more)])
            found["brown"] = alarmed(sorted((more / "brown").iterdir()), robot)
    print(json.dumps(found, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
