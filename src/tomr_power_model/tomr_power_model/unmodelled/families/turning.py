"""Terms of angles: of the wheel, of travel, of the heading."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion


@family
class TorqueByAngle(Family):
    """A tooth, a magnet, a roller: what comes again with every turn."""

    family_id = "torque.angle"
    acts = "torque"
    axes: ClassVar = (Axis("wheel angle", "rad", 36, is_periodic=True),)
    words = "a torque that depends on the wheel's angle"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return motion.angle[..., None]


@family
class TorqueByDirection(Family):
    """Rollers, or a load that leans on some wheels."""

    family_id = "torque.direction"
    acts = "torque"
    axes: ClassVar = (Axis("direction of travel", "rad", 12, is_periodic=True),)
    words = "a resistance that depends on the direction of travel"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return motion.direction[..., None]

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


@family
class TorqueByHeading(Family):
    """A floor with a grain."""

    family_id = "torque.heading"
    acts = "torque"
    axes: ClassVar = (Axis("heading", "rad", 12, is_periodic=True),)
    words = "a resistance that depends on the heading"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return motion.heading[..., None]

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign
