"""Terms with memory: of how long ago, and how far back, a wheel last stood."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion

_LATEST = 8.0  # s: longer ago counts as this
_FARTHEST = 12.0  # rad


@family
class TorqueSinceStand(Family):
    """Grease or a seal that relaxes while it moves."""

    family_id = "torque.since_stand"
    acts = "torque"
    axes: ClassVar = (Axis("time since a stand", "s", 24),)
    words = "a resistance that depends on the time since the wheel last stood"
    is_strange = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.minimum(motion.since_stand, _LATEST)[..., None]

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


@family
class TorqueTurnedSinceStand(Family):
    """Grease that holds until the wheel has turned."""

    family_id = "torque.turned"
    acts = "torque"
    axes: ClassVar = (Axis("angle turned since a stand", "rad", 24),)
    words = "a resistance that depends on how far the wheel has turned since it last stood"
    is_strange = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.minimum(motion.turned, _FARTHEST)[..., None]

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign
