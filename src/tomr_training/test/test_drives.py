"""Random drives: what a seed decides, and what it leaves."""

import pytest

from tomr_power_model.robot import shipped_robot
from tomr_training.drives import another_drive, random_drive

FIRST = random_drive(shipped_robot("reference"), 7, "encoder_lost")


def test_another_drive_is_of_the_same_robot_and_healthy() -> None:
    drive = another_drive(FIRST, 8)
    assert (drive.plant, drive.believed) == (FIRST.plant, FIRST.believed)
    assert drive.mission.phases != FIRST.mission.phases
    assert drive.mission.faults == drive.bumps == ()
    assert drive == another_drive(FIRST, 8)
    assert drive.mission.phases != another_drive(FIRST, 9).mission.phases


@pytest.mark.parametrize("kind", ["floor_slippery", "control_signal_lost", "encoder_lost"])
def test_another_drive_has_the_fault_that_is_asked_for(kind: str) -> None:
    drive = another_drive(FIRST, 8, kind)
    (fault,) = drive.mission.faults
    assert fault.fault_id == kind
    assert fault.end is not None
    assert 0.0 < fault.start < fault.end <= drive.length
    assert drive.mission.phases == another_drive(FIRST, 8).mission.phases
    assert {len(another_drive(FIRST, seed, "fault").mission.faults) for seed in range(20)} == {1}
    assert {len(another_drive(FIRST, seed, "any").mission.faults) for seed in range(20)} == {0, 1}
