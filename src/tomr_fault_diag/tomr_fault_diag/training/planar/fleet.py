"""The numbers of many robots side by side: arrays end with one column per robot, (..., n)."""

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.body import Body
from tomr_power_model.robot import WHEELS, Motor, Robot

Array = NDArray[np.float64]

RATE = 200.0  # Hz of the drivers, alike for the whole fleet
_EFFECTS = {"friction.coulomb", "friction.viscous", "electrical.driver_standby"}


@frozen
class Fleet:
    """Robots whose drivers run at 200 Hz, with dry and viscous friction and standby power.

    Shapes: (n,) for a number of the robot, (3, n) by wheel, (3, 3, n) for matrices.
    """

    wheel_radius: Array  # m
    robot_radius: Array  # m
    kinematics: Array  # K of omega = K nu
    to_twist: Array  # K^-1
    mass: Array  # kg
    mass_center: Array  # m, (2, n)
    mass_matrix: Array  # at base_link
    mass_inverse: Array
    load: Array  # static wheel loads [N]
    load_shift: Array  # wheel load per body acceleration in x, y [N s^2/m], (3, 2, n)
    inertia: Array  # wheel and rotor at the axle [kg m^2]
    resistance: Array  # ohm
    constant: Array  # at the wheel [N m/A]
    dry: Array  # N m
    viscous: Array  # N m s/rad
    standby: Array  # W
    proportional: Array
    integral: Array
    acceleration: Array  # limit [m/s^2], inf: none
    voltage: Array  # V
    auxiliary: Array  # W
    encoder_resolution: Array  # rad
    current_noise: Array  # A
    voltage_noise: Array  # V

    @classmethod
    def of(cls, robots: Sequence[Robot], payloads: Sequence[float] | None = None) -> Self:
        """Stack robots; raises InputError for one that the planar model cannot follow.

        `payloads` [kg] come on top of the mass, at its centre.
        """
        for robot in robots:
            _check(robot)
        extra = np.zeros(len(robots)) if payloads is None else np.array(payloads)
        bodies = [Body.of(robot) for robot in robots]
        factor = np.array(
            [1.0 + more / robot.mass for more, robot in zip(extra, robots, strict=True)]
        )
        matrices = _last([body.mass_matrix for body in bodies])
        yaw = np.array([robot.inertia_z for robot in robots])
        scaled = matrices * factor
        scaled[2, 2] += yaw * (
            1.0 - factor
        )  # a payload at the mass centre has no inertia of its own

        def number(read: Callable[[Robot], float]) -> Array:
            return np.array([read(robot) for robot in robots])

        def motor(read: Callable[[Motor], float]) -> Array:
            return np.array([[read(robot.motors[i]) for robot in robots] for i in range(WHEELS)])

        def effect(name: str, key: str) -> Array:
            return _last([np.array(robot.everywhere(name, key)) for robot in robots])

        return cls(
            wheel_radius=number(lambda robot: robot.wheel_radius),
            robot_radius=number(lambda robot: robot.robot_radius),
            kinematics=_last([twist_to_wheels(robot) for robot in robots]),
            to_twist=_last([body.to_twist for body in bodies]),
            mass=number(lambda robot: robot.mass) * factor,
            mass_center=_last([np.array(robot.mass_center[:2]) for robot in robots]),
            mass_matrix=scaled,
            mass_inverse=np.moveaxis(np.linalg.inv(np.moveaxis(scaled, -1, 0)), 0, -1),
            load=_last([body.normal for body in bodies]) * factor,
            load_shift=_last(list(map(_load_shift, robots, bodies))) * factor,
            inertia=_last([body.wheel_inertia for body in bodies]),
            resistance=motor(lambda item: item.resistance),
            constant=motor(lambda item: item.wheel_constant),
            dry=effect("friction.coulomb", "torque"),
            viscous=effect("friction.viscous", "coefficient"),
            standby=effect("electrical.driver_standby", "power"),
            proportional=number(lambda robot: robot.controller.proportional),
            integral=number(lambda robot: robot.controller.integral),
            acceleration=number(lambda robot: robot.controller.acceleration_limit or np.inf),
            voltage=number(lambda robot: robot.supply.nominal_voltage),
            auxiliary=number(lambda robot: robot.supply.auxiliary_power),
            encoder_resolution=number(lambda robot: robot.sensors.encoder_resolution),
            current_noise=number(lambda robot: robot.sensors.current_noise),
            voltage_noise=number(lambda robot: robot.sensors.voltage_noise),
        )

    def __len__(self) -> int:
        return len(self.mass)


def _last(items: Sequence[Array]) -> Array:
    return np.ascontiguousarray(np.stack(items, axis=-1))


def _load_shift(robot: Robot, body: Body) -> Array:
    """Balance of moments: accelerating forwards loads the wheels behind.

    sum N_i = m g, sum N_i p_i = m g c - m h a, with a the acceleration and h the height of c.
    """
    contacts = robot.robot_radius * body.axles
    balance = np.vstack([np.ones(WHEELS), contacts.T])
    height = robot.mass_center[2]
    shift = np.vstack([np.zeros(2), -robot.mass * height * np.eye(2)])
    return np.asarray(np.linalg.solve(balance, shift))


def _check(robot: Robot) -> None:
    unknown = set(robot.physics) - _EFFECTS
    if unknown or robot.controller.rate != RATE or robot.controller.delay:
        raise InputError(
            f"{', '.join(sorted(unknown)) or 'controller.rate or delay'}: the planar model for "
            f"training knows {', '.join(sorted(_EFFECTS))} and drivers of {RATE:g} Hz without "
            "delay: train on another robot"
        )
