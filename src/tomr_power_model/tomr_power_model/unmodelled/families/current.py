"""Terms of the motor's current."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, Resistance, family
from tomr_power_model.unmodelled.motion import Motion


def _flowing(motion: Motion) -> Array:
    return np.abs(motion.current)


@family
class TorqueByCurrent(Resistance):
    """A loss in the gear that grows otherwise than its load."""

    family_id = "torque.current"
    axes: ClassVar = (Axis("motor current", "A", 10, _flowing),)
    words = "a torque that depends on the motor's load"
    look = "the gear: its teeth and bearings under load"
    is_coupled = True


@family
class DriverByCurrent(Family):
    """A loss in the bridge that is no law of the vocabulary."""

    family_id = "driver.current"
    acts = "driver"
    axes: ClassVar = (Axis("motor current", "A", 12, _flowing),)
    words = "power lost in a driver that depends on its motor's current"
    look = "the driver: its bridge, its current sensor, the leads to the motor"


@family
class SupplyByCurrent(Family):
    """A loss on the way from the supply to the drivers."""

    family_id = "supply.current"
    acts = "supply"
    axes: ClassVar = (
        Axis(
            "sum of the motor currents", "A", 10, lambda m: _flowing(m).sum(axis=1, keepdims=True)
        ),
    )
    words = "power lost at the supply that depends on what the motors carry"
    look = "leads, plugs and fuse between the supply and the drivers"
