"""Wheels that slip."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    NEVER_SLIDES,
    Effect,
    EffectParameter,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import VARIED


@effect
class Slip(Effect):
    """Traction of a wheel limited to friction * N_i."""

    effect_id = "contact.slip"
    label = "Wheels slip"
    parameters = MappingProxyType(
        {"friction": EffectParameter("", 1e-3, neutral=NEVER_SLIDES, start=1.0)}
    )
    mission = VARIED
    needs_load = True

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """The least of several limits counts."""
        numbers.grip[wheel] = min(numbers.grip[wheel], parameters[0])
