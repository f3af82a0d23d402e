"""Sloping floor."""

import math
from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import HEADINGS


@effect
class Slope(Effect):
    """Floor tilted by `angle`, downhill towards `azimuth` in the world.

    The world is base_link at the start: a force m g sin(angle) that turns against the heading.
    """

    effect_id = "body.slope"
    place = "body"
    label = "The floor slopes"
    parameters = MappingProxyType(
        {
            "angle": EffectParameter("rad", maximum=1.0, prior_std=0.05),
            "azimuth": EffectParameter("rad", -1e2, 1e2),
        }
    )
    prior = HypothesisPrior(
        {"angle": lambda scales: 0.05},
        lambda scales: [{"azimuth": part * math.pi / 4.0} for part in range(8)],
    )
    shown_by = "circles and spins while driving, at several headings"
    mission = HEADINGS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Share of the weight that pulls downhill."""
        angle, azimuth = parameters
        numbers.floor_force[0] += math.sin(angle) * math.cos(azimuth)
        numbers.floor_force[1] += math.sin(angle) * math.sin(azimuth)
