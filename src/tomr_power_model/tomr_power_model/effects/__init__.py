"""The vocabulary of physical effects, one file each: law, numbers and all that is known of it.

Adding an effect is adding a file to one of these folders.
"""

import pkgutil
from importlib import import_module

from tomr_power_model.effects.base import (
    EFFECTS,
    LAWS,
    NEVER_SLIDES,
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    Wheel,
    effect,
)
from tomr_power_model.effects.user import load_named_effects

for _module in pkgutil.walk_packages(__path__, __name__ + "."):
    import_module(_module.name)
load_named_effects()

__all__ = [
    "EFFECTS",
    "LAWS",
    "NEVER_SLIDES",
    "Effect",
    "EffectParameter",
    "HypothesisPrior",
    "PlantNumbers",
    "Wheel",
    "effect",
]
