"""Viscous friction."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import SPEEDS


@effect
class Viscous(Effect):
    """tau = coefficient * omega."""

    effect_id = "friction.viscous"
    label = "Viscous friction"
    parameters = MappingProxyType({"coefficient": EffectParameter("N m s/rad", prior_std=0.05)})
    prior = HypothesisPrior({"coefficient": lambda scales: 0.5 * scales.torque / scales.speed})
    shown_by = "steady speeds at three levels or more, slow to fast, on every wheel"
    mission = SPEEDS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Damping is part of the discretised dynamics."""
        numbers.viscous[wheel] += parameters[0]
