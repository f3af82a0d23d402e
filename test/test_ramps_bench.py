"""Ramps of the bench, against their own limits."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

from ramps import over_ramps

from tomr_power_model.robot import GRAVITY, shipped_robot
from tomr_training.drives import Bump, Drive, random_drive

DRIVES = [random_drive(shipped_robot("reference"), seed, None).undisturbed for seed in range(5)]


def pull(bumps: tuple[Bump, ...], time: float) -> float:
    """Of the ramp that the robot is on at a time [N]."""
    forces = [one.force for one in bumps if one.start <= time < one.start + one.duration]
    return math.hypot(*np.sum(forces, axis=0)) if forces else 0.0


@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: str(drive.seed))
def test_a_robot_is_on_a_slope_most_of_the_time_and_never_on_a_steep_one(drive: Drive) -> None:
    found = over_ramps(drive)
    times = np.arange(0.0, drive.length, 0.05)
    pulls = np.array([pull(found.bumps, float(time)) for time in times])
    per_mass = pulls / drive.plant.mass
    assert per_mass[times < 1.0].max() == 0.0
    assert per_mass.max() <= GRAVITY * math.sin(math.radians(5.0)) + 1e-9
    assert np.abs(np.diff(per_mass)).max() <= 0.51 * per_mass.max()  # it gets onto them by and by
    assert 0.3 < (per_mass > 0.0).mean() < 0.95
    assert not found.mission.faults  # it is healthy
    assert over_ramps(drive) == found


def test_bumps_stay() -> None:
    bump = Bump(1.0, 0.1, (3.0, 0.0), 0.2)
    bumped = over_ramps(evolve(DRIVES[0], bumps=(bump,)))
    assert bump in bumped.bumps
    assert [one.is_slope for one in bumped.bumps if one != bump] == [True] * (len(bumped.bumps) - 1)
    assert len(bumped.bumps) > 1
