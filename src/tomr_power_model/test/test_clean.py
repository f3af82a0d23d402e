"""What is left out of a recording before it is used, and what is said about it."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.clean import check_duration, cleaned
from tomr_power_model.drive.motion import wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.messages.inertial import rotation
from tomr_power_model.robot import GRAVITY, shipped_robot

MakeDrive = Callable[..., Drive]
ROBOT = shipped_robot("reference")


@pytest.fixture
def drive(make_drive: MakeDrive) -> Drive:
    return make_drive(ROBOT, 1)


def test_a_healthy_recording_is_used_as_it_is(drive: Drive) -> None:
    found = cleaned(drive, ROBOT)
    assert found.notes == ()
    assert len(found.power) == len(drive.power)


@pytest.mark.parametrize(
    ("stream", "named"), [("power_time", "motor power"), ("command_time", "commands")]
)
def test_clocks_that_never_meet_are_refused(drive: Drive, stream: str, named: str) -> None:
    later = evolve(drive, **{stream: getattr(drive, stream) + 1e4})
    with pytest.raises(InputError, match=rf"{named} \(10000\.\d to 10040\.\d s\) and encoders"):
        cleaned(later, ROBOT)


def test_stray_stamps_are_left_out_and_noted(drive: Drive) -> None:
    """One sample an hour late must not make the recording an hour long."""
    time = drive.total_time.copy()
    time[-1] += 3600.0
    found = cleaned(evolve(drive, total_time=time), ROBOT)
    assert found.total_time[-1] < 40.0
    assert len(found.total) == len(drive.total) - 1
    assert found.notes == (
        "tour: 1 samples of battery_state lie outside of the encoders' time: left out",
    )


def test_blanks_are_noted(drive: Drive) -> None:
    power, position = drive.power.copy(), drive.position.copy()
    power[: len(power) // 5, 1] = np.nan
    position[: len(position) // 10, 2] = np.nan
    velocity = np.where(np.isnan(position), np.nan, drive.velocity)
    holed = evolve(drive, power=power, position=position, velocity=velocity)
    assert cleaned(holed, ROBOT).notes == (
        "tour: 10 % of the encoder of wheel_3_joint are NaN: left out",
        "tour: 20 % of wheel_2/power are NaN: left out",
    )


def test_a_recording_that_begins_in_motion_begins_later(drive: Drive) -> None:
    """What was commanded before is not in it."""
    moving = np.maximum(np.abs(drive.velocity), 2.0)
    found = cleaned(evolve(drive, velocity=moving), ROBOT)
    assert found.encoder_time[0] > 1.0
    assert found.power_time[0] > 1.0
    assert found.command_time[0] < -10.0
    np.testing.assert_array_equal(found.command[0], found.command[1])
    assert "it begins in motion" in found.notes[0]


def test_a_wheel_without_samples_is_refused(drive: Drive) -> None:
    blank = np.where(np.arange(3) == 0, np.nan, drive.position)
    dead = evolve(drive, position=blank, velocity=blank)
    with pytest.raises(InputError, match="wheel_1_joint: 100 % of the encoder's samples are NaN"):
        cleaned(dead, ROBOT)


def test_short_recordings_are_refused(make_drive: MakeDrive) -> None:
    with pytest.raises(InputError, match=r"1\.0 s are too short for a recording"):
        cleaned(make_drive(ROBOT, 1, seconds=1.0), ROBOT)
    with pytest.raises(InputError, match=r"8\.0 s are too short to decide anything"):
        check_duration((make_drive(ROBOT, 1, seconds=4.0), make_drive(ROBOT, 2, seconds=4.0)))


def with_imu(drive: Drive, rpy: tuple[float, float, float]) -> Drive:
    """And an IMU that is turned against base_link."""
    time = np.arange(0.0, drive.duration, 0.01)
    motion = wheel_motion(drive.encoder_time, drive.position, drive.velocity, time, 0.06)
    to_twist = wheels_to_twist(ROBOT)
    twist, rate = (np.nan_to_num(one @ to_twist.T) for one in (motion.speed, motion.acceleration))
    zero = np.zeros(len(time))
    turning = np.stack([zero, zero, twist[:, 2]], axis=1)
    across = np.stack([-twist[:, 1], twist[:, 0]], axis=1) * twist[:, 2:]
    force = np.column_stack([rate[:, :2] + across, zero + GRAVITY])
    axes = rotation(rpy)
    return evolve(drive, imu_time=time, inertial=np.hstack([turning @ axes, force @ axes]))


def test_an_imu_that_is_as_described_is_used(drive: Drive) -> None:
    found = cleaned(with_imu(drive, (0.0, 0.0, 0.0)), ROBOT)
    assert found.notes == ()
    assert len(found.imu_time) > 3000
    turned = evolve(ROBOT, imu_rpy=(math.pi, 0.0, 0.0))
    # What is read by the key is in base_link: nothing is turned twice.
    assert len(cleaned(with_imu(drive, (0.0, 0.0, 0.0)), turned).imu_time) > 3000


def test_one_that_is_not_is_left_out_and_noted(drive: Drive) -> None:
    found = cleaned(with_imu(drive, (math.pi, 0.0, 0.0)), ROBOT)
    assert found.notes == (
        "tour: imu/data is mounted otherwise than described: write robot.imu_rpy: [3.1416, 0, 0]; "
        "imu/data is left out",
    )
    assert len(found.imu_time) == len(found.yaw_rate) == 0
    assert len(found.power) == len(drive.power)
