"""What comes and goes: terms of the time alone, which no other drive repeats."""

from typing import ClassVar

from tomr_power_model.unmodelled.base import Axis, Family, Resistance, family

_TIME = (Axis("time", "s", 12, lambda m: m.time, spacing=1.0),)


@family
class TorqueByTime(Resistance):
    """Something that drags now and then, or runs in."""

    family_id = "torque.time"
    axes: ClassVar = _TIME
    words = "a resistance that changes with time"
    look = "what the robot met at the times shown: something that rubs, a part that runs in"
    is_event = True


@family
class ForceByTime(Family):
    """Gusts, pushes."""

    family_id = "force.time"
    acts = "force"
    axes: ClassVar = _TIME
    words = "a force on the body that changes with time"
    look = "what pushed the robot at the times shown: wind, people, a door"
    is_event = True


@family
class DriverByTime(Family):
    """Something that a driver does now and then."""

    family_id = "driver.time"
    acts = "driver"
    axes: ClassVar = _TIME
    words = "power drawn by a driver that changes with time"
    look = "what the driver did at the times shown, in its log"
    is_event = True


@family
class SupplyByTime(Family):
    """A consumer that comes and goes."""

    family_id = "supply.time"
    acts = "supply"
    axes: ClassVar = _TIME
    words = "power drawn at the supply that changes with time"
    look = "what else hangs on the supply and was switched at the times shown"
    is_event = True
