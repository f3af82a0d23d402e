"""Wheels that turn otherwise than commanded."""

from collections.abc import Callable

import numpy as np
from attrs import evolve

from tomr_power_model.calibration.following import lost_wheels
from tomr_power_model.drive.astray import not_following, otherwise_than_commanded
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import twist_to_wheels
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


def test_another_ramp_is_one_finding_and_not_what_follows_from_it(make_drive: MakeDrive) -> None:
    """Wheels behind their commands for a second at each turn, by a ramp of 0.6 m/s^2."""
    robot = evolve(ROBOT, controller=evolve(ROBOT.controller, acceleration_limit=0.0))
    time, now, seen = np.arange(0.0, 60.0, 0.05), 0.0, []
    asked = 0.7 * np.where(time % 6.0 < 3.0, 1.0, -1.0)
    for wanted in asked:
        before, now = now, now + float(np.clip(wanted - now, -0.03, 0.03))
        seen.append(0.5 * (before + now))
    drive = evolve(
        make_drive(robot, 1),
        encoder_time=time,
        position=np.full((len(time), 3), np.nan),
        velocity=np.outer(seen, twist_to_wheels(robot)[:, 0]),
    )
    expected = np.outer(asked, twist_to_wheels(robot)[:, 0])
    assert list(not_following(drive, robot, time, expected))
    (found,) = otherwise_than_commanded(drive, robot, time, expected)
    assert found.where == "all wheels"
    assert found.remedy.startswith("write controller.acceleration_limit: 0.6,")


def test_what_calibration_says_of_a_ramp_is_what_to_write(make_drive: MakeDrive) -> None:
    """The reference robot has 2 m/s^2, these wheels 0.6."""
    time, now, seen = np.arange(0.0, 40.0, 0.05), 0.0, []
    asked = 0.7 * np.where(time % 8.0 < 4.0, 1.0, -1.0)
    for wanted in asked:
        before, now = now, now + float(np.clip(wanted - now, -0.03, 0.03))
        seen.append(0.5 * (before + now))
    drive = evolve(
        make_drive(ROBOT, 1),
        encoder_time=time,
        position=np.full((len(time), 3), np.nan),
        velocity=np.outer(seen, twist_to_wheels(ROBOT)[:, 0]),
        command_time=time,
        command=np.outer(asked, (1.0, 0.0, 0.0)),
    )
    (found,) = lost_wheels(drive, ROBOT)
    assert "2 is described" in found.seen
    assert found.remedy.startswith("write controller.acceleration_limit: 0.6")
