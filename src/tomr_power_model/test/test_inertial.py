"""What an IMU's messages say in base_link."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.messages.bag import bag_message
from tomr_power_model.messages.inertial import Imu, rotation, rpy_of
from tomr_power_model.messages.intake import Unusable

STRAIGHT = Imu((0.0, 0.0, 0.0))
HALF = math.pi / 2.0


def _imu(rate: float = 0.5, force: float = 1.0) -> Any:
    turning = bag_message("geometry_msgs/msg/Vector3", z=rate)
    pull = bag_message("geometry_msgs/msg/Vector3", x=force, y=-2.0, z=9.8)
    return bag_message("sensor_msgs/msg/Imu", angular_velocity=turning, linear_acceleration=pull)


def test_an_imu_says_what_it_measures() -> None:
    assert STRAIGHT.read(_imu()) == ((0.0, 0.0, 0.5), (1.0, -2.0, 9.8))
    # What no robot on wheels feels is none, and a value that is not finite neither.
    assert np.isnan(STRAIGHT.read(_imu(force=1e6))[1]).all()
    assert np.isnan(STRAIGHT.read(_imu(rate=1e6))[0]).all()
    assert np.isnan(STRAIGHT.read(_imu(rate=math.nan))[0]).tolist() == [False, False, True]
    assert np.isnan(STRAIGHT.read(_imu(force=math.inf))[1]).tolist() == [True, False, False]


def test_what_an_imu_says_that_it_does_not_measure_is_not_known() -> None:
    message = _imu()
    message.linear_acceleration_covariance[0] = -1.0
    assert np.isnan(STRAIGHT.read(message)[1]).all()
    assert STRAIGHT.read(message)[0] == (0.0, 0.0, 0.5)
    message.angular_velocity_covariance[0] = -1.0
    with pytest.raises(Unusable, match="neither"):
        STRAIGHT.read(message)


@pytest.mark.parametrize(
    ("rpy", "rate", "force"),
    [
        ((math.pi, 0.0, 0.0), (0.0, 0.0, -0.5), (1.0, 2.0, -9.8)),
        ((0.0, 0.0, HALF), (0.0, 0.0, 0.5), (2.0, 1.0, 9.8)),
        ((0.0, -1.5708, 0.0), (-0.5, 0.0, 0.0), (-9.8, -2.0, 1.0)),
    ],
    ids=["upside down", "turned to the left", "on its back"],
)
def test_one_that_is_mounted_otherwise_is_read_in_base_link(
    rpy: tuple[float, float, float], rate: tuple[float, ...], force: tuple[float, ...]
) -> None:
    found = Imu(rpy).read(_imu())
    assert found[0] == pytest.approx(rate, abs=1e-4)
    assert found[1] == pytest.approx(force, abs=1e-3)


def test_an_axis_that_is_not_measured_spoils_no_other() -> None:
    rate, force = Imu((math.pi, 0.0, HALF)).read(_imu(force=math.nan))
    assert rate == pytest.approx((0.0, 0.0, -0.5))
    assert np.isnan(force).tolist() == [False, True, False]
    assert np.isnan(Imu((0.1, 0.0, 0.0)).read(_imu(rate=math.nan))[0]).tolist() == [
        False,
        True,
        True,
    ]


angles = st.floats(-3.1, 3.1)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_roll_pitch_and_yaw_are_those_of_their_rotation(
    roll: float, pitch: float, yaw: float
) -> None:
    assert rpy_of(rotation((roll, pitch, yaw))) == pytest.approx((roll, pitch, yaw), abs=1e-6)


@pytest.mark.parametrize("pitch", [HALF, -HALF])
def test_of_an_imu_that_stands_upright_the_rotation_is_right(pitch: float) -> None:
    turned = rotation((0.4, pitch, 1.1))
    assert rotation(rpy_of(turned)) == pytest.approx(turned, abs=1e-6)
