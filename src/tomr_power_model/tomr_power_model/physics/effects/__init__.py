"""The physics that a model may include, one class per effect of the vocabulary."""

from tomr_power_model.physics.effects import body, electrical, friction, kinematic
from tomr_power_model.physics.effects.base import (
    Effect,
    WheelState,
    effect,
    effects_of,
    modelled_effects,
)

__all__ = [
    "Effect",
    "WheelState",
    "body",
    "effect",
    "effects_of",
    "electrical",
    "friction",
    "kinematic",
    "modelled_effects",
]
