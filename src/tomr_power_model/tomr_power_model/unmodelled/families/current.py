"""Terms of the motor's current."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion


@family
class TorqueByCurrent(Family):
    """A loss in the gear that grows otherwise than its load."""

    family_id = "torque.current"
    acts = "torque"
    axes: ClassVar = (Axis("motor current", "A", 10),)
    words = "a torque that depends on the motor's load"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.abs(motion.current)[..., None]

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


@family
class DriverByCurrent(Family):
    """A loss in the bridge that is no law of the vocabulary."""

    family_id = "driver.current"
    acts = "driver"
    axes: ClassVar = (Axis("motor current", "A", 12),)
    words = "power lost in a driver that depends on its motor's current"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.abs(motion.current)[..., None]


@family
class SupplyByCurrent(Family):
    """A loss on the way from the supply to the drivers."""

    family_id = "supply.current"
    acts = "supply"
    axes: ClassVar = (Axis("sum of the motor currents", "A", 10),)
    words = "power lost at the supply that depends on what the motors carry"

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return np.asarray(np.abs(motion.current).sum(axis=1)[:, None, None])
