"""Which topics the odometry reads, and what it publishes."""

from collections.abc import Iterator
from typing import Any

from attrs import frozen
from numpy.typing import NDArray

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.grip import SIDE, Grid
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.messages.inertial import Imu
from tomr_power_model.messages.intake import stamp_of, twist_of
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.motion import odometry, quaternion, transform_of
from tomr_power_model.messages.plain import (
    Level,
    Plain,
    Status,
    diagnostics,
    header,
    joint_state,
    time,
)
from tomr_power_model.messages.types import (
    DIAGNOSTICS,
    IMU,
    JOINT_STATE,
    ODOMETRY,
    TF,
    TWIST,
    TWIST_STAMPED,
)
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Input, guarded, measured_inputs

ODOM_TOPIC, SLIP_TOPIC, STATUS_TOPIC = "odom_slip", "slip", "/diagnostics"
STATUS = "slip_odometry"
TF_TOPIC, FLOOR_TOPIC = "/tf", "floor_traction"
FLOOR = "nav_msgs/msg/OccupancyGrid"
_SIGMAS = 2.0  # of the interval of a traction
STATUS_PERIOD = 100_000_000  # ns of data
_OUT_OF_PLANE = 1e-6  # m^2, rad^2, and per second squared: a robot on wheels
OUTPUTS = {ODOM_TOPIC: ODOMETRY, SLIP_TOPIC: JOINT_STATE, STATUS_TOPIC: DIAGNOSTICS}


def outputs(settings: OdometrySettings) -> dict[str, str]:
    """Types of what is published, by topic."""
    asked = {TF_TOPIC: (settings.publish_tf, TF), FLOOR_TOPIC: (settings.publish_floor, FLOOR)}
    return OUTPUTS | {topic: kind for topic, (is_asked, kind) in asked.items() if is_asked}


@frozen
class Published:
    """A message on a topic."""

    topic: str
    stamp_ns: int
    message: Plain


def odometry_inputs(robot: Robot, core: SlipOdometry) -> tuple[Input, ...]:
    """The inputs of a core."""

    def command(message: Any, receive_ns: int) -> Arrival:
        return core.command(stamp_of(message, receive_ns, fallback=True), twist_of(message))

    inertial = Imu(robot.imu_rpy)

    def imu(message: Any, receive_ns: int) -> Arrival:
        rate, force = inertial.read(message)
        return core.imu(stamp_of(message, receive_ns), (*rate, *force))

    inputs = [Input("cmd_vel", TWIST_STAMPED, guarded(command), (TWIST, TWIST_STAMPED))]
    wheels = WheelStream(robot.wheel_names)
    inputs += measured_inputs(robot, core.encoders, core.power, wheels)
    if core.settings.use_imu:
        inputs.append(Input("imu/data", IMU, guarded(imu)))
    return tuple(inputs)


def _covariance(planar: NDArray[Any]) -> list[float]:
    """A covariance over x, y, yaw as one over six coordinates, those out of plane fixed."""
    places = (0, 1, 5)
    full = [0.0] * 36
    for i in (2, 3, 4):
        full[7 * i] = _OUT_OF_PLANE
    for i, row in zip(places, planar.tolist(), strict=True):
        for j, value in zip(places, row, strict=True):
            full[6 * i + j] = value
    return full


def _odometry(item: Estimate, settings: OdometrySettings) -> Plain:
    x, y, yaw = item.pose.tolist()
    v_x, v_y, omega_z = item.twist.tolist()
    return odometry(
        item.stamp_ns,
        (settings.odom_frame, settings.base_frame),
        (x, y, yaw),
        (v_x, v_y, omega_z),
        (_covariance(item.pose_covariance), _covariance(item.twist_covariance)),
    )


def _floor(item: Estimate, grid: Grid, settings: OdometrySettings) -> Plain:
    (x, y), (height, width) = grid.corner, grid.cells.shape
    point = Plain("geometry_msgs/msg/Point", {"x": x, "y": y, "z": 0.0})
    corner = {"position": point, "orientation": quaternion(0.0)}
    info = {
        "map_load_time": time(item.stamp_ns),
        "resolution": SIDE,
        "width": width,
        "height": height,
        "origin": Plain("geometry_msgs/msg/Pose", corner),
    }
    fields = {
        "header": header(item.stamp_ns, settings.odom_frame),
        "info": Plain("nav_msgs/msg/MapMetaData", info),
        "data": grid.cells.ravel().tolist(),
    }
    return Plain(FLOOR, fields)


def _status(robot: Robot, item: Estimate, namespace: str, hardware_id: str) -> Status:
    """What the estimate rests on; a number alone in each value, for PlotJuggler."""
    values = [("slipping", f"{float(item.is_slipping):g}")]
    for wheel, name in enumerate(robot.wheel_topics):
        used, std = item.traction[wheel], _SIGMAS * item.traction_std[wheel]
        low, high = item.available[wheel]
        numbers = {
            "slip_probability": item.probability[wheel],
            "creeping": item.creeping[wheel],
            "loss_of_traction": item.losing[wheel],
            "traction_used": used,
            "traction_used_low": used - std,
            "traction_used_high": used + std,
            "traction_available_low": low,
            "traction_available_high": high,
        }
        values += [(f"{name}_{what}", f"{number:.4g}") for what, number in numbers.items()]
    values += [(name, f"{value:.5g}") for name, value in item.learnt]
    level = Level.WARN if item.is_slipping or item.missing else Level.OK
    # Robots share /diagnostics: there the names of statuses begin with their namespaces.
    name = f"/{namespace}/{STATUS}" if namespace else STATUS
    return Status(name, level, item.words, tuple(values), hardware_id)


def estimate_messages(
    robot: Robot, item: Estimate, settings: OdometrySettings, namespace: str = ""
) -> Iterator[Published]:
    """What is published of an estimate.

    `slip` has for each wheel its slip ratio as position [-], how fast its contact slides as
    velocity [m/s], and the force that it transmits as effort [N], NaN where not known.
    """
    pose = _odometry(item, settings)
    yield Published(ODOM_TOPIC, item.stamp_ns, pose)
    yield Published(
        SLIP_TOPIC,
        item.stamp_ns,
        joint_state(
            item.stamp_ns,
            robot.wheel_names,
            position=item.slip.tolist(),
            velocity=item.sliding.tolist(),
            effort=item.traction.tolist(),
        ),
    )
    if item.stamp_ns % STATUS_PERIOD < settings.ticks.period:
        message = diagnostics(
            item.stamp_ns, [_status(robot, item, namespace, settings.hardware_id)]
        )
        yield Published(STATUS_TOPIC, item.stamp_ns, message)
    if item.floor is not None:
        message = _floor(item, item.floor, settings)
        yield Published(FLOOR_TOPIC, item.stamp_ns, message)
    if settings.publish_tf:
        yield Published(TF_TOPIC, item.stamp_ns, transform_of(pose))
