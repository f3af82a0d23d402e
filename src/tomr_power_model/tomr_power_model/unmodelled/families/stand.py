"""Terms with memory: of how long ago, and how far back, a wheel last stood."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Axis, Resistance, family

_LATEST = 8.0  # s: longer ago counts as this
_FARTHEST = 12.0  # rad


@family
class TorqueSinceStand(Resistance):
    """Grease or a seal that relaxes while it moves."""

    family_id = "torque.since_stand"
    axes: ClassVar = (
        Axis("time since a stand", "s", 24, lambda m: np.minimum(m.since_stand, _LATEST)),
    )
    words = "a resistance that depends on the time since the wheel last stood"
    look = "grease and seals of the gear; let the robot warm up and drive again"
    is_strange = True


@family
class TorqueTurnedSinceStand(Resistance):
    """Grease that holds until the wheel has turned."""

    family_id = "torque.turned"
    axes: ClassVar = (
        Axis("angle turned since a rest", "rad", 24, lambda m: np.minimum(m.turned, _FARTHEST)),
    )
    words = "a resistance that depends on how far the wheel has turned since it last rested"
    look = "grease of the gear; a brake that lets go late"
    is_strange = True


@family
class TorqueFromRest(Resistance):
    """A spot that a wheel has settled into, and comes back to."""

    family_id = "torque.from_rest"
    axes: ClassVar = (
        Axis("angle from where it rested", "rad", 24, lambda m: np.minimum(m.from_rest, _FARTHEST)),
    )
    words = "a resistance that depends on the angle between the wheel and where it last rested"
    look = "bearings and rollers for dents, tyres for flat spots where the robot was parked"
    is_strange = True
