"""What comes and goes: terms of the time alone, which no other drive repeats."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Array, Axis, Family, family
from tomr_power_model.unmodelled.motion import Motion

_TIME = (Axis("time", "s", 12, spacing=1.0),)


class _ByTime(Family):
    axes: ClassVar = _TIME
    is_event = True

    @staticmethod
    def coordinates(motion: Motion) -> Array:
        return motion.time[..., None]


@family
class TorqueByTime(_ByTime):
    """Something that drags now and then, or runs in."""

    family_id = "torque.time"
    acts = "torque"
    words = "a resistance that changes with time"

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


@family
class ForceByTime(_ByTime):
    """Gusts, pushes."""

    family_id = "force.time"
    acts = "force"
    words = "a force on the body that changes with time"


@family
class DriverByTime(_ByTime):
    """Something that a driver does now and then."""

    family_id = "driver.time"
    acts = "driver"
    words = "power drawn by a driver that changes with time"


@family
class SupplyByTime(_ByTime):
    """A consumer that comes and goes."""

    family_id = "supply.time"
    acts = "supply"
    words = "power drawn at the supply that changes with time"
