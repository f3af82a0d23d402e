"""Natural units of a robot: a friction of 1 means the same to a robot of 5 kg and one of 35 kg."""

from collections.abc import Mapping
from typing import Any, Self

from attrs import frozen

from tomr_power_model.robot import GRAVITY

Tree = Mapping[str, Mapping[str, Any]]

_SHARE = 0.01  # of the weight, a common rolling resistance
_CRUISE = 0.4  # m/s


@frozen
class Scales:
    """What is usual for a robot."""

    torque: float  # N m at the wheel: 1 % of weight times wheel radius
    speed: float  # rad/s of a wheel at 0.4 m/s
    power: float  # W: that torque at that speed
    current: float  # A: that torque
    supply_resistance: float  # ohm: 1 % of voltage squared over weight times 0.4 m/s
    thermal_resistance: float  # K/W that heats a winding by some 10 K in a lively drive
    traction: float  # friction coefficient at which full acceleration of the body needs half
    mass: float  # kg
    radius: float  # m, of the robot
    gear: float

    @classmethod
    def of(cls, nominal: Tree) -> Self:
        """The scales of a description, given as nested groups."""
        robot, motor = nominal["robot"], nominal["motor"]
        weight = robot["mass"] * GRAVITY
        torque = _SHARE * weight * robot["wheel_radius"]
        speed = _CRUISE / robot["wheel_radius"]
        constant = motor["torque_constant"] * motor["gear_ratio"]
        limit = nominal["controller"]["acceleration_limit"]
        hard = 1.3 * robot["mass"] * limit * robot["wheel_radius"] / 3.0 / constant
        return cls(
            torque=torque,
            speed=speed,
            power=torque * speed,
            current=torque / constant,
            supply_resistance=_SHARE
            * nominal["supply"]["nominal_voltage"] ** 2
            / (weight * _CRUISE),
            thermal_resistance=10.0 / (0.1 * hard**2 * motor["resistance"]),
            traction=limit / GRAVITY,
            mass=robot["mass"],
            radius=robot["robot_radius"],
            gear=motor["gear_ratio"],
        )
