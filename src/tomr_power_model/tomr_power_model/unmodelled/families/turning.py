"""Terms of angles: of the wheel, of travel, of the heading."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Axis, Family, Resistance, family


@family
class TorqueByAngle(Family):
    """A tooth, a magnet, a roller: what comes again with every turn."""

    family_id = "torque.angle"
    acts = "torque"
    axes: ClassVar = (Axis("wheel angle", "rad", 36, lambda m: m.angle, is_periodic=True),)
    words = "a torque that depends on the wheel's angle"
    look = "teeth, magnets and rollers at the angles shown"


@family
class DragByAngle(Resistance):
    """A tight spot of a bearing or a toothing: it resists whichever way the wheel turns."""

    family_id = "torque.tight_angle"
    axes: ClassVar = (Axis("wheel angle", "rad", 36, lambda m: m.angle, is_periodic=True),)
    words = "a resistance that depends on the wheel's angle"
    look = "the wheel at the angle shown: a bent shaft, a chipped tooth, a roller that jams"


@family
class TorqueByDirection(Resistance):
    """Rollers, or a load that leans on some wheels."""

    family_id = "torque.direction"
    axes: ClassVar = (
        Axis("direction of travel", "rad", 12, lambda m: m.direction, is_periodic=True),
    )
    words = "a resistance that depends on the direction of travel"
    look = "the rollers, and how the load rests on the wheels"


@family
class TorqueByHeading(Resistance):
    """A floor with a grain."""

    family_id = "torque.heading"
    axes: ClassVar = (Axis("heading", "rad", 12, lambda m: m.heading, is_periodic=True),)
    words = "a resistance that depends on the heading"
    look = "the floor: a nap, grooves, a slope"
