"""What the simulated robot publishes, and the messages that only it does."""

from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.messages import motion
from tomr_power_model.messages.motion import twist, vector3
from tomr_power_model.messages.plain import Plain, header
from tomr_power_model.messages.types import IMU, MULTI_ARRAY, TWIST_STAMPED


@frozen
class Sample:
    """A message on a topic, stamped with the time of its data."""

    topic: str
    stamp_ns: int
    message: Plain


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


def covariance(variances: Sequence[float]) -> list[float]:
    """A covariance matrix, by rows, of uncorrelated values."""
    matrix = [0.0] * len(variances) ** 2
    matrix[:: len(variances) + 1] = variances
    return matrix


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
    matrix = covariance(variances)
    v_x, v_y, omega_z = body_twist
    return motion.odometry(
        stamp_ns, (frame, "base_link"), pose, (v_x, v_y, omega_z), (matrix, matrix)
    )
