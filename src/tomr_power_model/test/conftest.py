"""Drives made up for the tests of calibration: motion and power known exactly."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.types import BATTERY, JOINT_STATE, TWIST, TWIST_STAMPED
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import Robot, shipped_robot

Array = NDArray[np.float64]
MakeDrive = Callable[..., Drive]
WriteBag = Callable[..., Path]
ROBOT = shipped_robot("reference")
_START_NS = 1_700_000_000 * 1_000_000_000

_ENCODER_STEP = 0.01  # s
_POWER_EVERY = 4  # encoder samples
_TURN = 0.6  # s that a change of twist takes
_LEG = 2.0  # s


@frozen
class Tour:
    """A smooth drive: every leg another twist, reached by half a cosine, one leg in six a stop."""

    time: Array  # (n,)
    twist: Array  # (n, 3)

    @classmethod
    def of(cls, seed: int, seconds: float) -> "Tour":
        random = np.random.default_rng(seed)
        time = np.arange(0.0, seconds, _ENCODER_STEP)
        legs = random.uniform(-1.0, 1.0, (int(seconds / _LEG) + 2, 3)) * (0.5, 0.5, 1.5)
        legs[::6] = 0.0
        leg = (time / _LEG).astype(int)
        share = np.clip((time - leg * _LEG) / _TURN, 0.0, 1.0)
        blend = (0.5 - 0.5 * np.cos(np.pi * share))[:, None]
        return cls(time, legs[leg] + blend * (legs[leg + 1] - legs[leg]))


@pytest.fixture
def make_drive() -> MakeDrive:
    """Makes a recording of a robot from a tour; `noise` [W] is that of each power sample."""

    def make(
        robot: Robot, seed: int = 1, seconds: float = 40.0, noise: float = 0.05, name: str = "tour"
    ) -> Drive:
        tour = Tour.of(seed, seconds)
        speed = tour.twist @ twist_to_wheels(robot).T
        acceleration = np.gradient(speed, _ENCODER_STEP, axis=0)
        position = np.cumsum(speed, axis=0) * _ENCODER_STEP
        position -= 0.5 * _ENCODER_STEP * (speed + speed[:1])  # trapezoids
        rows = slice(_POWER_EVERY, None, _POWER_EVERY)
        power = modelled_power(robot, WheelMotion(speed[rows], acceleration[rows]))
        random = np.random.default_rng(seed + 1000)
        power = power + noise * random.standard_normal(power.shape)
        return Drive(
            name=name,
            encoder_time=tour.time,
            position=position,
            velocity=speed,
            power_time=tour.time[rows],
            power=power[:, :3],
            reading=power[:, :3] / robot.supply.nominal_voltage,
            total_time=tour.time[rows],
            total=power[:, 3],
            command_time=tour.time[::5],
            command=tour.twist[::5],
            voltage=np.full((len(power), 3), robot.supply.nominal_voltage),
            total_voltage=np.full(len(power), robot.supply.nominal_voltage),
            yaw_time=np.empty(0),
            yaw_rate=np.empty(0),
        )

    return make


@pytest.fixture
def other_values() -> Callable[[Robot], Robot]:
    """The reference robot as it really is: every wheel another friction, a heavier body."""

    def changed(robot: Robot) -> Robot:
        scales = (1.3, 0.8, 1.1)
        physics = {
            effect: tuple(
                None if wheel is None else {key: value * scale for key, value in wheel.items()}
                for wheel, scale in zip(wheels, scales, strict=True)
            )
            for effect, wheels in robot.physics.items()
        }
        return evolve(robot, mass=robot.mass * 1.06, physics=physics)

    return changed


@pytest.fixture
def write_bag() -> WriteBag:
    """Writes a recording in the contract's form.

    `late` [s] shifts the stamps of topics, `voltage` is that of every supply, `received` says when
    a message that was sent at some time [s] reaches the recorder.
    """

    def write(
        drive: Drive,
        path: Path,
        late: Mapping[str, float | Array] = {},
        voltage: float = 24.0,
        received: Callable[[float], float] = lambda time: time,
    ) -> Path:
        names = list(ROBOT.wheel_names)
        messages: list[tuple[float, str, str, dict[str, object]]] = []
        for time, angle, speed in zip(
            drive.encoder_time, drive.position, drive.velocity, strict=True
        ):
            fields: dict[str, object] = {"name": names, "position": angle, "velocity": speed}
            messages.append((time, "joint_states", JOINT_STATE, fields))
        for time, power, total in zip(drive.power_time, drive.power, drive.total, strict=True):
            topics = [*(f"{name}/power" for name in ROBOT.wheel_topics), "battery_state"]
            for topic, drawn in zip(topics, (*power, total), strict=True):
                fields = {"voltage": voltage, "current": -float(drawn) / 24.0}
                messages.append((time, topic, BATTERY, fields))
        for time, (vx, vy, wz) in zip(drive.command_time, drive.command, strict=True):
            twist = bag_message(TWIST)
            twist.linear.x, twist.linear.y, twist.angular.z = float(vx), float(vy), float(wz)
            messages.append((time, "cmd_vel", TWIST_STAMPED, {"twist": twist}))
        counts: dict[str, int] = {}
        with RecordingWriter(path) as writer:
            for time, topic, kind, fields in sorted(messages, key=lambda item: item[:2]):
                number = counts[topic] = counts.get(topic, -1) + 1
                off = np.atleast_1d(late.get(topic, 0.0))
                stamp = _START_NS + round(1e9 * (time + float(off[number % len(off)])))
                message = bag_message(kind, header=bag_header(stamp), **fields)
                writer.write(topic, kind, message, _START_NS + round(1e9 * received(time)))
        return path

    return write
