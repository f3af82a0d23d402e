"""Messages of where a robot is and how it moves, in the plane."""

import math
from collections.abc import Sequence

from tomr_power_model.messages.plain import Plain, header
from tomr_power_model.messages.types import ODOMETRY, TF, TWIST

Triple = tuple[float, float, float]


def vector3(x: float, y: float, z: float) -> Plain:
    """geometry_msgs/Vector3."""
    return Plain("geometry_msgs/msg/Vector3", {"x": x, "y": y, "z": z})


def twist(v_x: float, v_y: float, omega_z: float) -> Plain:
    """geometry_msgs/Twist of a planar motion [m/s, rad/s]."""
    return Plain(
        TWIST,
        {"linear": vector3(v_x, v_y, 0.0), "angular": vector3(0.0, 0.0, omega_z)},
    )


def quaternion(yaw: float) -> Plain:
    """geometry_msgs/Quaternion of a heading [rad]."""
    return Plain(
        "geometry_msgs/msg/Quaternion",
        {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2.0), "w": math.cos(yaw / 2.0)},
    )


def odometry(
    stamp_ns: int,
    frames: tuple[str, str],
    pose: Triple,
    body_twist: Triple,
    covariances: tuple[Sequence[float], Sequence[float]],
) -> Plain:
    """nav_msgs/Odometry: planar pose (x, y [m], yaw [rad]) and twist in the robot's frame.

    `frames`: of the pose, and of the robot. `covariances` of pose and twist: six by six, by rows.
    """
    x, y, yaw = pose
    point = Plain("geometry_msgs/msg/Point", {"x": x, "y": y, "z": 0.0})
    place = Plain("geometry_msgs/msg/Pose", {"position": point, "orientation": quaternion(yaw)})
    with_doubt = {"pose": place, "covariance": covariances[0]}
    moving = {"twist": twist(*body_twist), "covariance": covariances[1]}
    return Plain(
        ODOMETRY,
        {
            "header": header(stamp_ns, frames[0]),
            "child_frame_id": frames[1],
            "pose": Plain("geometry_msgs/msg/PoseWithCovariance", with_doubt),
            "twist": Plain("geometry_msgs/msg/TwistWithCovariance", moving),
        },
    )


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
