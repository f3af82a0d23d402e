"""Wheels that turn otherwise than commanded."""

from collections.abc import Callable

import numpy as np

from tomr_power_model.drive.astray import not_following
from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import shipped_robot

MakeDrive = Callable[..., Drive]
ROBOT = shipped_robot("reference")


def test_wheels_are_held_against_any_expectation(make_drive: MakeDrive) -> None:
    """A fifth of a second late is a slow loop, for an explanation to say; backwards is a fault."""
    drive = make_drive(ROBOT, 1)
    time = drive.encoder_time[::5]
    expected = drive.velocity[::5]
    assert list(not_following(drive, ROBOT, time, expected)) == []
    late = np.roll(expected, 4, axis=0)
    assert list(not_following(drive, ROBOT, time, late)) == []
    found = list(not_following(drive, ROBOT, time, expected * np.array([1.0, -1.0, 1.0])))
    assert {item.where for item in found} == {"wheel_2_joint"}
    unknown = np.full_like(expected, np.nan)
    assert list(not_following(drive, ROBOT, time, unknown)) == []
    two = list(not_following(drive, ROBOT, time, expected * np.array([1.0, 0.2, 0.2])))
    assert {item.where for item in two} == {"wheel_2_joint", "wheel_3_joint"}
    late_now_and_then = np.where((time % 2.0 < 0.9)[:, None], 0.0, expected)
    assert list(not_following(drive, ROBOT, time, late_now_and_then)) == []
    (every,) = not_following(drive, ROBOT, time, 0.2 * expected)
    assert every.where == "all wheels"
    assert "controller.proportional" in every.remedy
