"""Terms of the place in the world, by dead reckoning from the start."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Axis, Family, Resistance, family

_BODY = (Axis("x", "m", 7, lambda m: m.x), Axis("y", "m", 7, lambda m: m.y))
_SPACING = 0.25  # m: a robot is about as wide
_FLOOR = (
    Axis("x of the wheel", "m", 7, lambda m: m.contact_x, spacing=_SPACING),
    Axis("y of the wheel", "m", 7, lambda m: m.contact_y, spacing=_SPACING),
)


@family
class TorqueByPlace(Resistance):
    """A floor that is not the same everywhere, whichever wheel is there."""

    family_id = "torque.place"
    axes: ClassVar = _FLOOR
    words = "a resistance that depends on the place on the floor"
    look = "the floor where the map shows it: another covering, a cable, dirt"
    is_strange = True
    is_shared = True


@family
class ForceByPlace(Family):
    """A spring, a tether, a wall, a floor that is not level everywhere."""

    family_id = "force.place"
    acts = "force"
    axes: ClassVar = _BODY
    words = "a force on the body that depends on where it is"
    look = "what holds the robot: a cable, a rope, a wall that it rubs along; a floor that slopes"
    is_strange = True
