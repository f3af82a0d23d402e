"""Terms of the place in the world, by dead reckoning from the start."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion

_FLOOR = (Axis("x", "m", 7), Axis("y", "m", 7))


@family
class TorqueByPlace(Family):
    """A floor that is not the same everywhere."""

    family_id = "torque.place"
    acts = "torque"
    axes: ClassVar = _FLOOR
    words = "a resistance that depends on the place on the floor"
    is_strange = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.stack([motion.x, motion.y], axis=-1)

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


@family
class ForceByPlace(Family):
    """A spring, a tether, a wall, a floor that is not level everywhere."""

    family_id = "force.place"
    acts = "force"
    axes: ClassVar = _FLOOR
    words = "a force on the body that depends on where it is"
    is_strange = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.stack([motion.x, motion.y], axis=-1)
