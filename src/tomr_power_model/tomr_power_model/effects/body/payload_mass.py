"""Payload."""

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
class PayloadMass(Effect):
    """Mass added at the mass centre."""

    effect_id = "body.payload_mass"
    place = "body"
    label = "The robot carries a payload"
    parameters = MappingProxyType({"mass": EffectParameter("kg", -1e4, 1e4, prior_std=5.0)})
    prior = HypothesisPrior({"mass": lambda scales: 0.2 * scales.mass})
    shown_by = "circles and spins while driving, at several headings"
    mission = HEADINGS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """It has no inertia of its own."""
        numbers.mass += parameters[0]
