"""The robot's sensors: rates, quanta, noise and the messages they make."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tomr_power_model.messages.inertial import rotation
from tomr_power_model.messages.plain import (
    NANOSECONDS,
    Level,
    Status,
    diagnostics,
    joint_state,
)
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.faults import FaultActions, FaultBoard, FaultState
from tomr_sim_bridge.plant import moments, samples
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.moments import Memory
from tomr_sim_bridge.plant.power_monitor import PowerMonitor
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.wheels import Vector, rolling_rows

FAULT_RATE = 20.0  # Hz of ground_truth/faults
_SLIPPING = "floor_slippery"  # the fault whose truth states how fast wheels slip
# Of wheel odometry, as drivers state it: x, y, z [m^2], roll, pitch, yaw [rad^2].
ODOMETRY_VARIANCES = (1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-2)


def quantise(values: Vector, quantum: float) -> Vector:
    """Values rounded to whole quanta; quantum 0 leaves them as they are."""
    return values if quantum == 0.0 else np.round(values / quantum) * quantum


class Clock:
    """Stamps of one sensor: a grid from the start on, each moved by a random jitter."""

    def __init__(
        self, rate: float, start_ns: int, jitter: float, random: np.random.Generator
    ) -> None:
        """`rate` in Hz, `jitter` a standard deviation [s], cut at 40 % of the period."""
        self._period = NANOSECONDS / rate
        self._start = start_ns
        self._jitter = jitter * NANOSECONDS
        self._random = random
        self._count = 0
        self.next_ns = start_ns

    def due(self, now_ns: int) -> Iterator[int]:
        """Yield the stamps up to now, each once."""
        while self.next_ns <= now_ns:
            yield self.next_ns
            self._count += 1
            shift = 0.0
            if self._jitter:
                most = 0.4 * self._period
                shift = float(np.clip(self._random.normal(0.0, self._jitter), -most, most))
            self.next_ns = self._start + round(self._count * self._period + shift)


class Sensors:
    """All sensors of a robot, read after every stretch."""

    def __init__(
        self,
        robot: Robot,
        design: PlantDesign,
        memory: Memory,
        random: np.random.Generator,
        jitter: float = 0.0,
    ) -> None:
        self._robot = robot
        self._design = design
        self._memory = memory
        self._random = random
        self._power = PowerMonitor(robot, design, memory, random)
        self._twist_of_wheels = np.linalg.inv(rolling_rows(robot)) * robot.wheel_radius
        start = memory.latest.stamp_ns
        given = robot.sensors
        rates = (
            (given.power_rate, self._power.samples),
            (given.encoder_rate, self._joint_states),
            (given.imu_rate, self._imu),
            (given.odometry_rate, self._odometry),
        )
        self._imu_axes = rotation(robot.imu_rpy)  # from the IMU's to base_link
        self._streams = [(Clock(rate, start, jitter, random), read) for rate, read in rates]
        self._fault_clock = Clock(FAULT_RATE, start, 0.0, random)
        self._last_encoder = (start, self._counts(start))
        self._last_imu = (start, memory.latest.values[moments.VELOCITY])
        self._last_slip = (start, memory.latest.values[moments.SLIP])
        self._odometry_angle = self._counts(start)
        self._odometry_pose = (0.0, 0.0, 0.0)
        self._odometry_stamp = start

    def read(
        self, faults: FaultBoard, actions: FaultActions, commanded: Sequence[float]
    ) -> list[Sample]:
        """Return the samples that have fallen due, in the order of their stamps.

        `commanded`: voltages, by the drivers [V].
        """
        self._power.actions, self._power.commanded = actions, list(commanded)
        now = self._memory.latest.stamp_ns
        found: list[Sample] = []
        for clock, read in self._streams:
            if clock.next_ns <= now:
                for stamp in clock.due(now):
                    found.extend(read(stamp))
        for stamp in self._fault_clock.due(now):
            found.append(self._faults(stamp, faults.states()))
        found.sort(key=lambda sample: sample.stamp_ns)
        return found

    def _counts(self, stamp: int) -> Vector:
        angle = self._memory.at(stamp)[moments.ENCODER]
        return quantise(angle, self._robot.sensors.encoder_resolution)

    def _joint_states(self, stamp: int) -> list[Sample]:
        before, angle_before = self._last_encoder
        angle = self._counts(stamp)
        elapsed = (stamp - before) / NANOSECONDS
        speed = (angle - angle_before) / elapsed if elapsed > 0 else np.zeros(WHEELS)
        speed = quantise(speed, self._robot.sensors.velocity_resolution)
        self._last_encoder = (stamp, angle)
        message = joint_state(
            stamp,
            self._robot.wheel_names,
            position=angle.tolist(),
            velocity=speed.tolist(),
            effort=self._power.efforts,
        )
        return [Sample("joint_states", stamp, message)]

    def _imu(self, stamp: int) -> list[Sample]:
        before, velocity_before = self._last_imu
        state = self._memory.at(stamp)
        velocity = state[moments.VELOCITY]
        elapsed = (stamp - before) / NANOSECONDS
        pull = (velocity - velocity_before) / elapsed if elapsed > 0 else np.zeros(3)
        self._last_imu = (stamp, velocity)
        force = _into_body(pull - self._design.gravity, state[moments.YAW])
        given = self._robot.sensors
        force += given.accelerometer_noise * self._random.standard_normal(3)
        turning = state[moments.ANGULAR] + given.gyro_noise * self._random.standard_normal(3)
        turning, force = self._imu_axes.T @ turning, self._imu_axes.T @ force
        return [Sample("imu/data", stamp, samples.imu(stamp, turning.tolist(), force.tolist()))]

    def _odometry(self, stamp: int) -> list[Sample]:
        angle = self._counts(stamp)
        step = self._twist_of_wheels @ (angle - self._odometry_angle)
        x, y, yaw = self._odometry_pose
        middle = yaw + step[2] / 2.0
        x += step[0] * math.cos(middle) - step[1] * math.sin(middle)
        y += step[0] * math.sin(middle) + step[1] * math.cos(middle)
        self._odometry_pose = (float(x), float(y), float(yaw + step[2]))
        elapsed = (stamp - self._odometry_stamp) / NANOSECONDS
        speed = step / elapsed if elapsed > 0 else np.zeros(3)
        self._odometry_angle, self._odometry_stamp = angle, stamp
        pose = self._odometry_pose
        measured = samples.odometry(stamp, "odom", pose, speed.tolist(), ODOMETRY_VARIANCES)
        state = self._memory.at(stamp)
        place = (*state[moments.POSITION].tolist(), float(state[moments.YAW]))
        velocity = _into_body(state[moments.VELOCITY], state[moments.YAW])
        truth = [float(velocity[0]), float(velocity[1]), float(state[moments.ANGULAR][2])]
        true = samples.odometry(stamp, "world", place, truth)
        return [Sample("odom", stamp, measured), Sample("ground_truth/odom", stamp, true)]

    def _faults(self, stamp: int, faults: list[FaultState]) -> Sample:
        before, slip_before = self._last_slip
        slip = self._memory.at(stamp)[moments.SLIP]
        elapsed = (stamp - before) / NANOSECONDS
        speed = (slip - slip_before) / elapsed if elapsed > 0 else np.zeros(WHEELS)
        self._last_slip = (stamp, slip)
        slipping = {
            f"slip_speed_{topic}": float(value)
            for topic, value in zip(self._robot.wheel_topics, speed, strict=True)
        }
        statuses = []
        for fault in faults:
            values = {"active": float(fault.active), "severity": fault.severity}
            if fault.wheel is not None:
                values["wheel"] = fault.wheel + 1.0
            if fault.fault_id == _SLIPPING:
                values |= slipping
            message = "in force" if fault.active else "not in force"
            texts = tuple((key, f"{value:.6g}") for key, value in values.items())
            statuses.append(Status(fault.fault_id, Level.OK, message, texts, "simulator"))
        return Sample("ground_truth/faults", stamp, diagnostics(stamp, statuses))


def _into_body(vector: Vector, yaw: float) -> Vector:
    """Rotate a world vector (x, y, z) into base_link."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    x, y, z = vector
    return np.array([cosine * x + sine * y, cosine * y - sine * x, z])
