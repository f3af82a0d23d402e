"""One file of the public Robotino v2 data set as a recording of the contract's form.

Source: data set `BrOleg5/research-wheel-slippage` (Apache-2.0) of a Festo Robotino v2, about
32 samples/s of wheel encoders, motor currents and the pose seen by an overhead camera.

What its columns mean, checked on 432 floor drives and three bench runs:

- Wheel order and angles are the contract's with wheel_offset 60 degrees; the direction of turning
  is opposite, since its rows are [-sin d, cos d, R]/r. The set motor speeds follow from the set
  robot speeds to 5e-4 rad/s with R = 0.125 m, r = 0.040 m and gear 16.
- Ticks: the position's rate over the velocity column is 314.2 ticks/rad (1970 to 1976 per turn,
  alike for speed, direction and floor, 0.2 % apart between motors). The velocity's quantum is 27
  rpm, one tick in 1/900 s of an encoder with 2000 ticks per turn; hence 2000 it is, and the
  velocity column reads 1.3 % high because the drives' clocks are that much slow. Velocities are
  handed on as recorded.
- Currents are magnitudes. Their sign cannot be recovered: the set's own body currents take the
  sign of the measured velocity, which is wrong while a motor brakes.
- On the bench the position register was cleared before 97 % of the readings: those recordings
  carry no positions. All three motors turn at once there.
- The camera's image is x right, y down, angle anti-clockwise, 0 when the robot points up.
  The pose columns are complete; the per-sample deltas miss the motion of 1.3 % of the samples.
- A command is in force from the first sample on; wheels answer 0.09 to 0.15 s later.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import Plain, battery_state, joint_state
from tomr_power_model.recordings import RecordingWriter
from tomr_sim_bridge.importers.tables import Table, read_table
from tomr_sim_bridge.plant.samples import command_sample, odometry

Array = NDArray[np.float64]

GEAR_RATIO = 16.0  # motor turns per wheel turn
TICKS_PER_TURN = 2000.0  # of the motor shaft
METRES_PER_PIXEL = (1.84046e-3, 1.83716e-3)  # along the image's x and y
EPOCH_NS = 1_672_531_200_000_000_000  # every recording begins here: 2023-01-01T00:00:00Z
NANOSECONDS_PER_MILLISECOND = 1e6

JOINTS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
POWER_TOPICS = ("wheel_1/power", "wheel_2/power", "wheel_3/power")

SET_BODY = ("xsetspeed", "ysetspeed", "setvel")
SET_MOTOR = ("m1setvel", "m2setvel", "m3setvel")
POSITION = ("m1pos", "m2pos", "m3pos")
VELOCITY = ("m1vel", "m2vel", "m3vel")
CURRENT = ("m1cur", "m2cur", "m3cur")

FLOOR_UNITS = {
    **dict(zip(SET_BODY, ("m/s", "m/s", "rad/s"), strict=True)),
    "xpos": "pix",
    "ypos": "pix",
    "ang": "deg",
}
UNITS = {
    "t": "ms",
    **dict.fromkeys(SET_MOTOR, "rad/s"),
    **dict.fromkeys(POSITION, "ticks"),
    **dict.fromkeys(VELOCITY, "rad/s"),
    **dict.fromkeys(CURRENT, "A"),
    **FLOOR_UNITS,
}


@frozen
class Drive:
    """What only a drive on the floor has."""

    command: Array  # (samples, 3): v_x, v_y [m/s], omega_z [rad/s] commanded, in base_link
    pose: Array  # (samples, 3): x, y [m], yaw [rad], unwrapped, in map
    twist: Array  # (samples, 3): v_x, v_y [m/s], omega_z [rad/s] seen, in base_link


@frozen
class Run:
    """One file in SI units, at the wheels."""

    stamps_ns: tuple[int, ...]
    position: Array | None  # (samples, 3) wheel angles [rad]; None: not usable
    velocity: Array  # (samples, 3) wheel speeds [rad/s]
    wheel_command: Array  # (samples, 3) wheel speeds commanded [rad/s]
    current: Array  # (samples, 3) magnitude of the motor currents [A]
    drive: Drive | None  # None: on the bench, wheels in the air

    @property
    def duration_s(self) -> float:
        """From the first to the last sample [s]."""
        return (self.stamps_ns[-1] - self.stamps_ns[0]) * 1e-9

    @property
    def largest_gap_s(self) -> float:
        """The longest pause between two samples [s]."""
        return float(np.diff(self.stamps_ns).max(initial=0)) * 1e-9


def read_run(path: Path, place: str) -> Run:
    """Read one file of the data set; `place` is its name in errors (InputError)."""
    table = read_table(path, place, UNITS, frozenset(FLOOR_UNITS))
    on_floor = SET_BODY[0] in table.columns
    offsets = np.round(table["t"] * NANOSECONDS_PER_MILLISECOND).astype(np.int64)
    turn = -2.0 * math.pi / (TICKS_PER_TURN * GEAR_RATIO)
    return Run(
        stamps_ns=tuple(EPOCH_NS + int(offset) for offset in offsets),
        position=table.stack(POSITION) * turn if on_floor else None,
        velocity=_at_wheel(table.stack(VELOCITY)),
        wheel_command=_at_wheel(table.stack(SET_MOTOR)),
        current=np.abs(table.stack(CURRENT)),
        drive=_drive(table) if on_floor else None,
    )


def camera_pose(x_pixel: Array, y_pixel: Array, angle_degrees: Array) -> Array:
    """Return x, y [m] and unwrapped yaw [rad] of shape (samples, 3) in a z-up frame (REP-103).

    The frame's x points up the image and its y to the left, so that yaw is the camera's angle.
    """
    x = -METRES_PER_PIXEL[1] * y_pixel
    y = -METRES_PER_PIXEL[0] * x_pixel
    return np.column_stack([x, y, np.unwrap(np.radians(angle_degrees))])


def body_twist(pose: Array, time_s: Array) -> Array:
    """Return v_x, v_y [m/s] and omega_z [rad/s] in the body frame, shape (samples, 3).

    Backward differences of the pose, turned by the mean yaw of the two samples: they integrate
    to the pose, and are as noisy as its pixels. The first sample has no past and reads zero.
    """
    step = np.diff(pose, axis=0) / np.diff(time_s)[:, None]
    yaw = (pose[1:, 2] + pose[:-1, 2]) / 2.0
    cos, sin = np.cos(yaw), np.sin(yaw)
    twist = np.zeros_like(pose)
    twist[1:, 0] = cos * step[:, 0] + sin * step[:, 1]
    twist[1:, 1] = -sin * step[:, 0] + cos * step[:, 1]
    twist[1:, 2] = step[:, 2]
    return twist


def write_run(run: Run, path: Path, storage: str) -> None:
    """Write a run as a rosbag2 recording; all messages of a sample share its stamp.

    Topics: `joint_states`, `wheel_<i>/power` (voltage NaN, current the negative magnitude of the
    motor current) and, on the floor, `cmd_vel` and `ground_truth/odom`, on the bench
    `wheel_command` (JointState, velocities commanded). A command is repeated at every sample,
    because every row of the data states the one in force.
    """
    with RecordingWriter(path, storage) as writer:
        for index, stamp_ns in enumerate(run.stamps_ns):
            for topic, message in _messages(run, index, stamp_ns):
                writer.write(topic, message.type_name, to_bag(message), stamp_ns)


def _messages(run: Run, index: int, stamp_ns: int) -> Iterator[tuple[str, Plain]]:
    """Topics and messages of one sample."""
    if run.drive is None:
        command = run.wheel_command[index].tolist()
        yield "wheel_command", joint_state(stamp_ns, JOINTS, velocity=command)
    else:
        yield "cmd_vel", command_sample(stamp_ns, *run.drive.command[index].tolist()).message
        x, y, yaw = run.drive.pose[index].tolist()
        seen = run.drive.twist[index].tolist()
        yield "ground_truth/odom", odometry(stamp_ns, "map", (x, y, yaw), seen)
    position = () if run.position is None else run.position[index].tolist()
    velocity = run.velocity[index].tolist()
    yield "joint_states", joint_state(stamp_ns, JOINTS, position=position, velocity=velocity)
    for topic, current in zip(POWER_TOPICS, run.current[index].tolist(), strict=True):
        yield topic, _power(stamp_ns, current)


def _power(stamp_ns: int, current: float) -> Plain:
    message = battery_state(stamp_ns, math.nan, -current)
    discharging = 2  # POWER_SUPPLY_STATUS_DISCHARGING
    return Plain(message.type_name, {**message.fields, "power_supply_status": discharging})


def _drive(table: Table) -> Drive:
    pose = camera_pose(table["xpos"], table["ypos"], table["ang"])
    return Drive(
        command=table.stack(SET_BODY), pose=pose, twist=body_twist(pose, table["t"] * 1e-3)
    )


def _at_wheel(motor_speeds: Array) -> Array:
    return motor_speeds * (-1.0 / GEAR_RATIO)
