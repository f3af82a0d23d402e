"""Terms of the velocity in the world."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion


@family
class ForceByVelocity(Family):
    """A wind, a conveyor, a nap of the carpet."""

    family_id = "force.velocity"
    acts = "force"
    axes: ClassVar = (Axis("velocity along x", "m/s", 5), Axis("velocity along y", "m/s", 5))
    words = "a force on the body that depends on its velocity in the world"
    is_strange = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.stack([motion.velocity_x, motion.velocity_y], axis=-1)
