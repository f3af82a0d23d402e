"""What a plant is built from: the description, as changed by the effects it includes."""

import numpy as np
from attrs import define, field

from tomr_power_model.robot import GRAVITY, WHEELS, Robot
from tomr_sim_bridge.plant.wheels import Vector

DEFAULT_FLOOR_FRICTION = 0.8


def _zeros() -> Vector:
    return np.zeros(WHEELS)


@define
class PlantDesign:
    """Numbers that stay as they are once the model is built. Arrays have shape (3,): per wheel."""

    mass: float  # kg
    mass_center: Vector  # m in base_link
    gravity: Vector  # m/s^2 in the world
    wheel_radius: Vector  # m
    floor_friction: Vector  # traction coefficient
    supply_resistance: float = 0.0  # ohm
    power_scale: Vector = field(factory=lambda: np.ones(WHEELS))  # of the power measurement
    power_bias: Vector = field(factory=_zeros)  # W
    power_lag: Vector = field(factory=_zeros)  # s
    power_delay: Vector = field(factory=_zeros)  # s
    total_scale: float = 1.0  # of the measurement of the whole robot's power
    encoder_scale: Vector = field(factory=lambda: np.ones(WHEELS))  # counts per true count
    encoder_center: Vector = field(factory=lambda: np.zeros((WHEELS, 2)))  # disc, over its radius

    @classmethod
    def of(cls, robot: Robot) -> "PlantDesign":
        """The plant as described, before any effect."""
        return cls(
            mass=robot.mass,
            mass_center=np.array(robot.mass_center),
            gravity=np.array([0.0, 0.0, -GRAVITY]),
            wheel_radius=np.full(WHEELS, robot.wheel_radius),
            floor_friction=np.full(WHEELS, DEFAULT_FLOOR_FRICTION),
        )
