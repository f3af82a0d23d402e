"""Drives made up for the tests of calibration: motion and power known exactly."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.problem import modelled_power
from tomr_power_model.drive.record import Drive
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.model import WheelMotion
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
MakeDrive = Callable[..., Drive]

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
