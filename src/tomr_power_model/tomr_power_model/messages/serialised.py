"""What stages read of the messages that come most often, straight from their bytes.

A BatteryState has nineteen fields and an Imu three matrices, of which stages need a few: to build
all of them takes five to ten times as long. The bytes are CDR as DDS has it: four bytes of head,
then every number at a multiple of its size, strings with their length before and a zero behind.
"""

import struct
from collections.abc import Callable, Mapping
from types import MappingProxyType

from attrs import frozen

from tomr_power_model.messages.types import BATTERY, IMU

_HEAD = b"\0\1"  # little-endian, of the first version: what all of ROS 2's DDS speak here
_START = 4  # of the fields, from which alignment counts
_HEADER = struct.Struct("<iII")  # stamp, and the length of frame_id
_BATTERY = struct.Struct("<fff")  # voltage, temperature, current
# Orientation and its covariance, then rates and forces, each with a covariance.
_IMU = struct.Struct("<104x3dd64x3dd")


@frozen
class Stamp:
    """A builtin_interfaces/Time."""

    sec: int
    nanosec: int


@frozen
class Header:
    """Of a std_msgs/Header what counts."""

    stamp: Stamp


@frozen
class Battery:
    """Of a sensor_msgs/BatteryState what is read."""

    header: Header
    voltage: float  # V
    current: float  # A


@frozen
class Vector:
    """A geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


@frozen
class Inertial:
    """Of a sensor_msgs/Imu what is read; of covariances their first number."""

    header: Header
    angular_velocity: Vector  # rad/s
    angular_velocity_covariance: tuple[float]
    linear_acceleration: Vector  # m/s^2
    linear_acceleration_covariance: tuple[float]


def _header(data: bytes, alignment: int) -> tuple[Header, int]:
    """The header, and where a field of some alignment after it begins."""
    if data[:2] != _HEAD:
        raise struct.error("another representation")
    seconds, rest, length = _HEADER.unpack_from(data, _START)
    end = _HEADER.size + length
    return Header(Stamp(seconds, rest)), _START + -(-end // alignment) * alignment


def _battery(data: bytes) -> Battery:
    header, place = _header(data, 4)
    voltage, _, current = _BATTERY.unpack_from(data, place)
    return Battery(header, voltage, current)


def _imu(data: bytes) -> Inertial:
    header, place = _header(data, 8)
    x, y, z, rates, ahead, aside, up, forces = _IMU.unpack_from(data, place)
    return Inertial(header, Vector(x, y, z), (rates,), Vector(ahead, aside, up), (forces,))


Reader = Callable[[bytes], Battery | Inertial]
_READERS: Mapping[str, Reader] = MappingProxyType({BATTERY: _battery, IMU: _imu})


def quickly_read(type_name: str, data: bytes) -> Battery | Inertial | None:
    """A message of some type from its bytes, or None: then whoever asks has to deserialise it."""
    reader = _READERS.get(type_name)
    if reader is None:
        return None
    try:
        return reader(data)
    except struct.error:
        return None
