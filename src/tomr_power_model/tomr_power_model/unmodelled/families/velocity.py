"""Terms of the velocity in the world."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Axis, Family, family


@family
class ForceByVelocity(Family):
    """A wind, a conveyor, a nap of the carpet."""

    family_id = "force.velocity"
    acts = "force"
    axes: ClassVar = (
        Axis("velocity along x", "m/s", 5, lambda m: m.velocity_x),
        Axis("velocity along y", "m/s", 5, lambda m: m.velocity_y),
    )
    words = "a force on the body that depends on its velocity in the world"
    look = "what moves against the floor: wind, a fan, a conveyor, the nap of a carpet"
    is_strange = True
    is_coupled = True
