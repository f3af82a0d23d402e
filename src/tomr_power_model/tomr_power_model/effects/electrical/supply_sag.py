"""Sag of the supply voltage."""

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
class SupplySag(Effect):
    """Supply voltage falls by `resistance` times the total current."""

    effect_id = "electrical.supply_sag"
    place = "supply"
    label = "The supply voltage sags"
    parameters = MappingProxyType({"resistance": EffectParameter("ohm", prior_std=0.2)})
    prior = HypothesisPrior({"resistance": lambda scales: 0.02 * scales.voltage / scales.current})
    shown_by = "hard acceleration with the supply's voltage recorded"
    mission = HEADINGS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Resistance of battery and leads [ohm]."""
        numbers.voltage_drop += parameters[0]
