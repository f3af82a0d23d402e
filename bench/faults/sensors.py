"""The same set as other sensors would have recorded it."""

import shutil
from pathlib import Path

import other_sensors
from tqdm import tqdm

from faults.recordings import Recordings

_KINDS = ("healthy", "healthy_long", "drives")


def record(recordings: Recordings, kind: str, folder: Path) -> Path:
    """Write the set as other sensors record it; returns what TOMR_RECORDINGS is to be then."""
    there = folder / recordings.folder.name
    bags = [bag for group in _KINDS for bag in recordings.drives(group)]
    for drive in tqdm(bags, desc=kind, unit="drive"):
        other_sensors.record(drive.bag, kind, there / drive.bag.relative_to(recordings.folder))
    shutil.copytree(recordings.truth, there / recordings.truth.name, dirs_exist_ok=True)
    shutil.copy(recordings.scorer, there)
    new = there / "faults" / recordings.robot / "robot.yaml"
    other_sensors.describe(recordings.description, kind, new)
    return folder
