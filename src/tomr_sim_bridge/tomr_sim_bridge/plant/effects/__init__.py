"""The plant's own versions of the contract's effects; importing this fills the registry."""

from tomr_sim_bridge.plant.effects import body, contact, electrical, friction, measurement
from tomr_sim_bridge.plant.effects.base import (
    DriverPower,
    PlantEffect,
    WheelLoads,
    make_effects,
    plant_effect,
    plant_effects,
)

__all__ = [
    "DriverPower",
    "PlantEffect",
    "WheelLoads",
    "body",
    "contact",
    "electrical",
    "friction",
    "make_effects",
    "measurement",
    "plant_effect",
    "plant_effects",
]
