"""Effects on the body: what it weighs, where its mass sits, what it stands on."""

import numpy as np
from attrs import evolve, frozen

from tomr_power_model.physics.effects.base import Array, Effect, effect
from tomr_power_model.robot import GRAVITY, Robot


@effect("body.payload_mass")
@frozen
class PayloadMass(Effect):
    """Mass added at the mass centre."""

    mass: Array  # kg

    def changed(self, robot: Robot) -> Robot:
        return evolve(robot, mass=robot.mass + float(self.mass[0]))


@effect("body.mass_center_offset")
@frozen
class MassCenterOffset(Effect):
    """Mass centre displaced in the plane."""

    x: Array  # m
    y: Array  # m

    def changed(self, robot: Robot) -> Robot:
        x, y, z = robot.mass_center
        return evolve(robot, mass_center=(x + float(self.x[0]), y + float(self.y[0]), z))


@effect("body.slope")
@frozen
class Slope(Effect):
    """Floor tilted by `angle`, downhill towards `azimuth` in the world.

    The world is base_link at the start: a force m g sin(angle) that turns against the heading.
    """

    angle: Array  # rad
    azimuth: Array  # rad

    def floor_force(self, mass: Array, heading: Array) -> Array:
        towards = self.azimuth[..., :1] - heading
        force = mass * GRAVITY * np.sin(self.angle[..., :1])
        return np.concatenate([force * np.cos(towards), force * np.sin(towards)], axis=-1)
