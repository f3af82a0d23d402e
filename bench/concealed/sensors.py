"""The same cases as other sensors would have recorded them."""

import shutil
from pathlib import Path

import other_sensors
from tqdm import tqdm

_KEPT = "sim"  # the simulation's sensors are as they are


def record(cases: Path, kind: str, folder: Path) -> None:
    """Write all cases of a folder as other sensors record them, into FOLDER/cases."""
    for case in tqdm(sorted(cases.iterdir()), desc=kind, unit="case"):
        new = folder / "cases" / case.name
        new.mkdir(parents=True, exist_ok=True)
        for item in sorted(case.iterdir()):
            if item.name == "robot.yaml":
                other_sensors.describe(item, kind, new / item.name)
            elif item.name == _KEPT:
                shutil.copytree(item, new / item.name, dirs_exist_ok=True)
            elif item.is_dir():
                other_sensors.record(item, kind, new / item.name)
