"""The physics that a model may include, one class per effect of the vocabulary."""

from tomr_power_model.physics.effects import body, electrical, friction, kinematic, sensor
from tomr_power_model.physics.effects.base import (
    Effect,
    WheelState,
    acting,
    effect,
    effects_of,
    modelled_effects,
    stacked_effects,
)
from tomr_power_model.physics.effects.electrical import COPPER

__all__ = [
    "COPPER",
    "Effect",
    "WheelState",
    "acting",
    "body",
    "effect",
    "effects_of",
    "electrical",
    "friction",
    "kinematic",
    "modelled_effects",
    "sensor",
    "stacked_effects",
]
