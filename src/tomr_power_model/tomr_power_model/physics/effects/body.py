"""Effects that change the body: what it weighs and where its mass sits."""

from attrs import evolve, frozen

from tomr_power_model.physics.effects.base import Array, Effect, effect
from tomr_power_model.robot import Robot


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
