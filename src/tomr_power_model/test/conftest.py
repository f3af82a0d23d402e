"""Robots, vehicles and drives that tests share."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.dynamics.simulation import Simulation, Steps
from tomr_power_model.dynamics.vehicle import Vehicle, WheelPlace, omni_wheel, vehicle_of
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.types import BATTERY, JOINT_STATE, TWIST, TWIST_STAMPED
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import Controller, Robot, shipped_robot

Array = NDArray[np.float64]
MakeDrive = Callable[..., Drive]
WriteBag = Callable[..., Path]
ROBOT = shipped_robot("reference")
_START_NS = 1_700_000_000 * 1_000_000_000
MakeVehicle = Callable[..., Vehicle]
DriveVehicle = Callable[..., "Driven"]

KINDS = ("three_omni", "four_omni", "four_mecanum", "two_driven")

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
            imu_time=np.empty(0),
            inertial=np.empty((0, 6)),
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


def _of_kind(kind: str) -> Vehicle:
    """The reference robot on other wheels."""
    vehicle = vehicle_of(shipped_robot("reference"))
    corners = [(0.2, 0.15), (-0.2, 0.15), (-0.2, -0.15), (0.2, -0.15)]
    if kind == "four_omni":
        angles = [math.pi * (0.25 + 0.5 * wheel) for wheel in range(4)]
        wheels = [omni_wheel(0.2 * math.cos(a), 0.2 * math.sin(a), a + math.pi / 2) for a in angles]
    elif kind == "four_mecanum":  # the rollers on the floor lie along a diamond's sides
        wheels = [WheelPlace(x, y, 0.0, math.copysign(math.pi / 4, x * y)) for x, y in corners]
    elif kind == "two_driven":
        wheels = [WheelPlace(0.0, y, 0.0, None) for y in (0.15, -0.15)]
    else:
        return vehicle
    n = len(wheels)
    return evolve(
        vehicle,
        wheels=tuple(wheels),
        motors=(vehicle.motors[0],) * n,
        physics={effect: (given[0],) * n for effect, given in vehicle.physics.items()},
        casters=((0.2, 0.0), (-0.2, 0.0)) if kind == "two_driven" else (),
    )


@pytest.fixture(scope="session")
def make_vehicle() -> MakeVehicle:
    """Makes a vehicle of one of KINDS: the reference robot on other wheels.

    `physics` replaces its effects, alike at all wheels; `further` adds to them; what else is given
    replaces fields of the vehicle, or of its controller.
    """

    def make(
        kind: str = "three_omni",
        physics: Mapping[str, Mapping[str, float]] | None = None,
        further: Mapping[str, Mapping[str, float]] | None = None,
        **changes: Any,
    ) -> Vehicle:
        vehicle = _of_kind(kind)
        n = vehicle.count
        present = dict(vehicle.physics) if physics is None else {}
        for effect_id, given in {**(physics or {}), **(further or {})}.items():
            present[effect_id] = (given,) * n
        loop = {name: changes.pop(name) for name in tuple(changes) if hasattr(Controller, name)}
        controller = evolve(vehicle.controller, **loop)
        return evolve(vehicle, physics=present, controller=controller, **changes)

    return make


@frozen
class Driven:
    """What a simulation did, period by period."""

    steps: Steps
    twist: Array  # of the body after each period [m/s, m/s, rad/s], (k, 3)
    wheels: Array  # the wheels' part of the state after each period, (k, n, STATE_WHEEL)
    state: list[float]  # at the end


@pytest.fixture(scope="session")
def drive_vehicle() -> DriveVehicle:
    """Drives a vehicle in plain Python through commanded twists, (k, 3), from rest or a state.

    `inputs` are those of every period before its command: fields of the wheels by their offsets.
    """

    def run(
        vehicle: Vehicle,
        commands: Array,
        state: list[float] | None = None,
        inputs: Mapping[int, float] | None = None,
    ) -> Driven:
        simulation = Simulation(vehicle)
        state = simulation.start() if state is None else state
        asked = simulation.inputs()
        for wheel in range(vehicle.count):
            for offset, value in (inputs or {}).items():
                asked[at.INPUT_HEADER + wheel * at.INPUT_WHEEL + offset] = value
        out, twists, wheels = [], [], []
        for command in commands.tolist():
            asked[at.COMMAND : at.COMMAND + 3] = command
            out.append(simulation.advance(state, asked))
            twists.append(state[at.TWIST : at.TWIST + 3])
            wheels.append(state[at.STATE_HEADER :])
        shape = (len(commands), vehicle.count, at.STATE_WHEEL)
        steps = Steps.of(np.array(out), vehicle.count)
        return Driven(steps, np.array(twists), np.array(wheels).reshape(shape), state)

    return run
