"""Displaced mass centre."""

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
class MassCenterOffset(Effect):
    """Mass centre displaced in the plane: normal loads and yaw coupling."""

    effect_id = "body.mass_center_offset"
    place = "body"
    label = "The mass centre is displaced"
    parameters = MappingProxyType(
        {
            "x": EffectParameter("m", -10.0, 10.0, prior_std=0.02),
            "y": EffectParameter("m", -10.0, 10.0, prior_std=0.02),
        }
    )
    prior = HypothesisPrior(
        {"x": lambda scales: 0.15 * scales.arm, "y": lambda scales: 0.15 * scales.arm}, sign=0
    )
    shown_by = "circles and spins while driving, at several headings"
    mission = HEADINGS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Adds to the described place [m]."""
        numbers.mass_center[0] += parameters[0]
        numbers.mass_center[1] += parameters[1]
