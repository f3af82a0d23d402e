"""What a plant effect is, and the registry that the plant makes them from."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from attrs import define, field

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.wheels import Vector


@define
class WheelLoads:
    """Resistance at the axles during the coming stretch. Arrays have shape (3,): per wheel."""

    speed: Vector  # rad/s, now
    angle: Vector  # rad, as the encoder counts it
    transmitted: Vector  # N m through the gear during the last stretch
    normal: Vector  # N on the contact; only if an effect asks for it, else zero
    contact: Vector  # m, where the wheels stand in the world, shape (3, 2)
    dry: Vector  # N m, to be filled: Coulomb-like, holds at standstill
    viscous: Vector  # N m s/rad, to be filled
    torque: Vector  # N m, to be filled: added to the axle
    roller_force: Vector  # N, to be filled: against the sliding along the axle
    # N, N, N m, to be filled: force in the world and moment on the body, at its mass centre
    push: Vector = field(factory=lambda: np.zeros(3))


@define
class DriverPower:
    """Electrical side of a stretch that has passed. Arrays have shape (3,): per wheel."""

    duration: float  # s
    current: Vector  # A, mean motor current
    motor_power: Vector  # W, mean terminal power of the motors
    power: Vector  # W, to be filled: mean power drawn by the drivers
    resistance: Vector  # ohm, to be filled: of the windings during the next stretch
    other: float = 0.0  # W, to be filled: drawn from the supply by what is no driver


class PlantEffect:
    """One effect of the contract's vocabulary, as this plant does it.

    A subclass overrides the stages at which it has a say; absent wheels get neutral values.
    """

    effect_id: ClassVar[str]
    needs_normal_force: ClassVar[bool] = False

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    def values(self, key: str, absent: float = 0.0) -> Vector:
        """One parameter at the three wheels, shape (3,), `absent` where it is left out."""
        return np.array(self._robot.everywhere(self.effect_id, key, absent))

    def shape(self, design: PlantDesign) -> None:
        """Change the design before the model is built."""

    def resist(self, loads: WheelLoads) -> None:
        """Add torques for the coming stretch."""

    def bill(self, drivers: DriverPower) -> None:
        """Change the power of the stretch that has passed."""


_REGISTRY: dict[str, type[PlantEffect]] = {}


def plant_effect(effect_id: str) -> Callable[[type[PlantEffect]], type[PlantEffect]]:
    """Register a class as the plant's version of an effect."""

    def register(effect: type[PlantEffect]) -> type[PlantEffect]:
        effect.effect_id = effect_id
        _REGISTRY[effect_id] = effect
        return effect

    return register


def plant_effects() -> list[str]:
    """Ids of the effects that the plant can do."""
    return sorted(_REGISTRY)


def make_effects(robot: Robot) -> list[PlantEffect]:
    """The effects of a robot's description, in the order of the registry.

    Raises InputError for an effect that the plant cannot do.
    """
    for effect_id in robot.physics:
        if effect_id not in _REGISTRY:
            raise InputError(
                f"physics.{effect_id}: the simulator cannot do this effect: leave it out; "
                f"it can do {', '.join(plant_effects())}"
            )
    return [effect(robot) for key, effect in _REGISTRY.items() if key in robot.physics]
