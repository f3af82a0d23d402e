"""What the simulated robot publishes, and the messages that only it does."""

import math
from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.messages.plain import Plain, header
from tomr_power_model.messages.types import IMU, MULTI_ARRAY, ODOMETRY, TF, TWIST, TWIST_STAMPED


@frozen
class Sample:
    """A message on a topic, stamped with the time of its data."""

    topic: str
    stamp_ns: int
    message: Plain


def vector3(x: float, y: float, z: float) -> Plain:
    """geometry_msgs/Vector3."""
    return Plain("geometry_msgs/msg/Vector3", {"x": x, "y": y, "z": z})


def twist(v_x: float, v_y: float, omega_z: float) -> Plain:
    """geometry_msgs/Twist of a planar motion [m/s, rad/s]."""
    return Plain(
        TWIST,
        {"linear": vector3(v_x, v_y, 0.0), "angular": vector3(0.0, 0.0, omega_z)},
    )


def command_sample(stamp_ns: int, v_x: float, v_y: float, omega_z: float) -> Sample:
    """cmd_vel as TwistStamped."""
    fields = {"header": header(stamp_ns, "base_link"), "twist": twist(v_x, v_y, omega_z)}
    return Sample("cmd_vel", stamp_ns, Plain(TWIST_STAMPED, fields))


def multi_array(values: list[float]) -> Plain:
    """std_msgs/Float64MultiArray; it has no stamp."""
    return Plain(MULTI_ARRAY, {"data": values})


def imu(stamp_ns: int, angular: list[float], linear: list[float]) -> Plain:
    """sensor_msgs/Imu [rad/s, m/s^2] in base_link, without an orientation."""
    return Plain(
        IMU,
        {
            "header": header(stamp_ns, "base_link"),
            "orientation_covariance": [-1.0] + [0.0] * 8,
            "angular_velocity": vector3(*angular),
            "linear_acceleration": vector3(*linear),
        },
    )


def quaternion(yaw: float) -> Plain:
    """geometry_msgs/Quaternion of a heading [rad]."""
    return Plain(
        "geometry_msgs/msg/Quaternion",
        {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2.0), "w": math.cos(yaw / 2.0)},
    )


def covariance(variances: Sequence[float]) -> list[float]:
    """A covariance matrix, by rows, of uncorrelated values."""
    matrix = [0.0] * len(variances) ** 2
    matrix[:: len(variances) + 1] = variances
    return matrix


def transform_of(odometry: Plain) -> Plain:
    """tf2_msgs/TFMessage that says what a nav_msgs/Odometry does."""
    pose = _part(_part(odometry, "pose"), "pose")
    point = _part(pose, "position").fields
    place = Plain(
        "geometry_msgs/msg/Transform",
        {
            "translation": Plain("geometry_msgs/msg/Vector3", point),
            "rotation": pose.fields["orientation"],
        },
    )
    fields = {key: odometry.fields[key] for key in ("header", "child_frame_id")}
    stamped = Plain("geometry_msgs/msg/TransformStamped", {**fields, "transform": place})
    return Plain(TF, {"transforms": [stamped]})


def _part(message: Plain, name: str) -> Plain:
    part = message.fields[name]
    assert isinstance(part, Plain)
    return part


def odometry(
    stamp_ns: int,
    frame: str,
    pose: tuple[float, float, float],
    body_twist: list[float],
    variances: Sequence[float] = (0.0,) * 6,
) -> Plain:
    """nav_msgs/Odometry: planar pose (x, y [m], yaw [rad]) and twist in base_link.

    `variances` of x, y, z [m^2], roll, pitch, yaw [rad^2], and per second squared of the twist.
    """
    x, y, yaw = pose
    matrix = covariance(variances)
    point = Plain("geometry_msgs/msg/Point", {"x": x, "y": y, "z": 0.0})
    place = Plain("geometry_msgs/msg/Pose", {"position": point, "orientation": quaternion(yaw)})
    return Plain(
        ODOMETRY,
        {
            "header": header(stamp_ns, frame),
            "child_frame_id": "base_link",
            "pose": Plain(
                "geometry_msgs/msg/PoseWithCovariance", {"pose": place, "covariance": matrix}
            ),
            "twist": Plain(
                "geometry_msgs/msg/TwistWithCovariance",
                {"twist": twist(*body_twist), "covariance": matrix},
            ),
        },
    )
