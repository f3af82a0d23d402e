"""Terms of the wheel's speed."""

from typing import ClassVar

import numpy as np

from tomr_power_model.unmodelled.base import Array, Axis, Family, Resistance, family
from tomr_power_model.unmodelled.motion import Motion

_SPEED = (Axis("wheel speed", "rad/s", 12, lambda m: np.abs(m.speed)),)


@family
class TorqueBySpeed(Resistance):
    """A friction that is no law of the vocabulary."""

    family_id = "torque.speed"
    axes: ClassVar = _SPEED
    words = "a torque that depends on the wheel's speed"
    look = "the wheel's bearings, seal and grease, and whether something rubs on it"
    is_coupled = True


@family
class TorqueBySignedSpeed(Family):
    """A friction that differs with the way the wheel turns."""

    family_id = "torque.signed_speed"
    acts = "torque"
    axes: ClassVar = (Axis("signed wheel speed", "rad/s", 16, lambda m: m.speed),)
    words = "a torque that depends on the wheel's speed and the way it turns"
    look = "the gear and what rubs on the wheel in one direction only"
    holds = "torque.speed"
    is_coupled = True

    @staticmethod
    def factor(motion: Motion) -> Array:
        return np.abs(motion.sign)


@family
class DriverBySpeed(Family):
    """Power that no torque shows."""

    family_id = "driver.speed"
    acts = "driver"
    axes: ClassVar = _SPEED
    words = "power drawn by a driver that depends on its wheel's speed"
    look = "the driver: its switching, and what else hangs on its supply line"
