"""Effects that the kinematics read straight from the robot's description."""

from attrs import frozen

from tomr_power_model.physics.effects.base import Array, Effect, effect


@effect("kinematic.wheel_radius")
@frozen
class WheelRadius(Effect):
    """A wheel's effective radius is `scale` times the nominal; see `geometry.wheel_radii`."""

    scale: Array
