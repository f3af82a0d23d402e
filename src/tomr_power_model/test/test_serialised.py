"""Messages read straight from their bytes, against rclpy."""

import math
from array import array
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import BatteryState, Imu, JointState

from tomr_power_model.messages.intake import battery_of, header_stamp_ns, yaw_rate_of
from tomr_power_model.messages.serialised import quickly_read
from tomr_power_model.messages.types import BATTERY, IMU, JOINT_STATE

SECONDS = st.integers(0, 2**31 - 1)
NANOSECONDS = st.integers(0, 10**9 - 1)
FRAMES = st.text(max_size=20)
SINGLE = st.floats(width=32)
DOUBLE = st.floats()


def same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))


def stamped(message: Any, seconds: int, rest: int, frame: str) -> Any:
    message.header.stamp.sec, message.header.stamp.nanosec = seconds, rest
    message.header.frame_id = frame.replace("\0", "")
    return message


@given(SECONDS, NANOSECONDS, FRAMES, SINGLE, SINGLE, st.lists(SINGLE, max_size=4))
def test_a_battery_is_read_as_rclpy_reads_it(
    seconds: int, rest: int, frame: str, voltage: float, current: float, cells: list[float]
) -> None:
    given = stamped(BatteryState(voltage=voltage, current=current), seconds, rest, frame)
    given.temperature, given.cell_voltage, given.location = 20.0, array("f", cells), frame[:3]
    data = serialize_message(given)
    found, wanted = quickly_read(BATTERY, data), deserialize_message(data, BatteryState)
    assert found is not None
    assert header_stamp_ns(found) == header_stamp_ns(wanted)
    assert same(found.voltage, wanted.voltage)
    assert same(found.current, wanted.current)


@given(SECONDS, NANOSECONDS, FRAMES, st.lists(DOUBLE, min_size=8, max_size=8))
def test_an_imu_is_read_as_rclpy_reads_it(
    seconds: int, rest: int, frame: str, values: list[float]
) -> None:
    given = stamped(Imu(), seconds, rest, frame)
    rates, forces = given.angular_velocity, given.linear_acceleration
    rates.x, rates.y, rates.z, forces.x, forces.y, forces.z = values[:6]
    given.orientation.w, given.orientation_covariance[0] = 0.5, 3.0
    given.angular_velocity_covariance[0], given.linear_acceleration_covariance[0] = values[6:]
    given.angular_velocity_covariance[1] = given.linear_acceleration_covariance[8] = 7.0
    data = serialize_message(given)
    found, wanted = quickly_read(IMU, data), deserialize_message(data, Imu)
    assert found is not None
    assert header_stamp_ns(found) == header_stamp_ns(wanted)
    for vector in ("angular_velocity", "linear_acceleration"):
        for axis in "xyz":
            one, other = (getattr(getattr(item, vector), axis) for item in (found, wanted))
            assert same(one, other)
        first = getattr(found, f"{vector}_covariance")[0]
        assert same(first, getattr(wanted, f"{vector}_covariance")[0])


def test_stages_read_from_it_what_they_need() -> None:
    battery = serialize_message(BatteryState(voltage=24.0, current=-0.5))
    assert battery_of(quickly_read(BATTERY, battery)) == (24.0, -0.5)
    imu = Imu()
    imu.angular_velocity.z = 0.75
    assert yaw_rate_of(quickly_read(IMU, serialize_message(imu))) == 0.75


@pytest.mark.parametrize("cut", range(0, 40, 3))
def test_what_is_cut_off_or_otherwise_is_left_to_rclpy(cut: int) -> None:
    data = serialize_message(BatteryState(voltage=24.0, current=-0.5))
    assert quickly_read(BATTERY, data[: min(cut, 27)]) is None
    assert quickly_read(BATTERY, b"\0\0" + data[2:]) is None  # big-endian
    assert quickly_read(JOINT_STATE, serialize_message(JointState())) is None
    lying = data[:12] + b"\xff\xff\xff\xff" + data[16:]  # of the length of a string
    assert quickly_read(BATTERY, lying) is None
