"""Messages without ROS: plain nested records that a bag or a node turns into its own kind."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from attrs import frozen

_KEY_VALUE = "diagnostic_msgs/msg/KeyValue"
NANOSECONDS = 1_000_000_000


@frozen
class Plain:
    """A message: its type and its fields; a field may hold further messages or lists of them."""

    type_name: str
    fields: Mapping[str, object]


@frozen
class Sample:
    """A message on a topic, stamped with the time of its data."""

    topic: str
    stamp_ns: int
    message: Plain


def build(plain: Plain, make: Callable[..., Any]) -> Any:
    """Turn a plain message into what `make(type_name, **fields)` returns."""
    return make(
        plain.type_name, **{name: _value(value, make) for name, value in plain.fields.items()}
    )


def _value(value: object, make: Callable[..., Any]) -> object:
    if isinstance(value, Plain):
        return build(value, make)
    if isinstance(value, list) and value and isinstance(value[0], Plain):
        return [build(item, make) for item in value]
    return value


def header(stamp_ns: int, frame_id: str = "") -> Plain:
    """std_msgs/Header."""
    seconds, rest = divmod(stamp_ns, NANOSECONDS)
    time = Plain("builtin_interfaces/msg/Time", {"sec": seconds, "nanosec": rest})
    return Plain("std_msgs/msg/Header", {"stamp": time, "frame_id": frame_id})


def vector3(x: float, y: float, z: float) -> Plain:
    """geometry_msgs/Vector3."""
    return Plain("geometry_msgs/msg/Vector3", {"x": x, "y": y, "z": z})


def twist(v_x: float, v_y: float, omega_z: float) -> Plain:
    """geometry_msgs/Twist of a planar motion [m/s, rad/s]."""
    return Plain(
        "geometry_msgs/msg/Twist",
        {"linear": vector3(v_x, v_y, 0.0), "angular": vector3(0.0, 0.0, omega_z)},
    )


def command_sample(stamp_ns: int, v_x: float, v_y: float, omega_z: float) -> Sample:
    """cmd_vel as TwistStamped."""
    fields = {"header": header(stamp_ns, "base_link"), "twist": twist(v_x, v_y, omega_z)}
    return Sample("cmd_vel", stamp_ns, Plain("geometry_msgs/msg/TwistStamped", fields))


def joint_state(
    stamp_ns: int,
    names: tuple[str, ...],
    position: list[float],
    velocity: list[float],
    effort: list[float],
) -> Plain:
    """sensor_msgs/JointState [rad, rad/s]; effort [A] for robots that publish currents so."""
    return Plain(
        "sensor_msgs/msg/JointState",
        {
            "header": header(stamp_ns),
            "name": list(names),
            "position": position,
            "velocity": velocity,
            "effort": effort,
        },
    )


def battery_state(stamp_ns: int, place: str, voltage: float, current: float) -> Plain:
    """sensor_msgs/BatteryState [V, A]: the current is negative while it draws power."""
    unknown = math.nan
    return Plain(
        "sensor_msgs/msg/BatteryState",
        {
            "header": header(stamp_ns),
            "voltage": voltage,
            "current": current,
            "temperature": unknown,
            "charge": unknown,
            "capacity": unknown,
            "design_capacity": unknown,
            "percentage": unknown,
            "present": True,
            "location": place,
        },
    )


def multi_array(values: list[float]) -> Plain:
    """std_msgs/Float64MultiArray; it has no stamp."""
    return Plain("std_msgs/msg/Float64MultiArray", {"data": values})


def imu(stamp_ns: int, angular: list[float], linear: list[float]) -> Plain:
    """sensor_msgs/Imu [rad/s, m/s^2] in base_link, without an orientation."""
    return Plain(
        "sensor_msgs/msg/Imu",
        {
            "header": header(stamp_ns, "base_link"),
            "orientation_covariance": [-1.0] + [0.0] * 8,
            "angular_velocity": vector3(*angular),
            "linear_acceleration": vector3(*linear),
        },
    )


def odometry(
    stamp_ns: int, frame: str, pose: tuple[float, float, float], body_twist: list[float]
) -> Plain:
    """nav_msgs/Odometry: planar pose (x, y [m], yaw [rad]) and twist in base_link."""
    x, y, yaw = pose
    quaternion = Plain(
        "geometry_msgs/msg/Quaternion",
        {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2.0), "w": math.cos(yaw / 2.0)},
    )
    point = Plain("geometry_msgs/msg/Point", {"x": x, "y": y, "z": 0.0})
    place = Plain("geometry_msgs/msg/Pose", {"position": point, "orientation": quaternion})
    return Plain(
        "nav_msgs/msg/Odometry",
        {
            "header": header(stamp_ns, frame),
            "child_frame_id": "base_link",
            "pose": Plain("geometry_msgs/msg/PoseWithCovariance", {"pose": place}),
            "twist": Plain("geometry_msgs/msg/TwistWithCovariance", {"twist": twist(*body_twist)}),
        },
    )


def diagnostics(stamp_ns: int, statuses: Sequence[tuple[str, str, Mapping[str, float]]]) -> Plain:
    """diagnostic_msgs/DiagnosticArray of (name, message, numeric values), all of level OK."""
    return Plain(
        "diagnostic_msgs/msg/DiagnosticArray",
        {
            "header": header(stamp_ns),
            "status": [
                Plain(
                    "diagnostic_msgs/msg/DiagnosticStatus",
                    {
                        "level": b"\x00",
                        "name": name,
                        "message": message,
                        "hardware_id": "simulator",
                        "values": [
                            Plain(
                                "diagnostic_msgs/msg/KeyValue",
                                {"key": key, "value": f"{value:.6g}"},
                            )
                            for key, value in values.items()
                        ],
                    },
                )
                for name, message, values in statuses
            ],
        },
    )
