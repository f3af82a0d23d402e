"""Effective wheel radius."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import VARIED


@effect
class WheelRadius(Effect):
    """A wheel's effective radius is `scale` times the nominal."""

    effect_id = "kinematic.wheel_radius"
    label = "A wheel's effective radius differs"
    parameters = MappingProxyType({"scale": EffectParameter("", 0.1, 10.0, neutral=1.0, start=1.0)})
    prior = HypothesisPrior({"scale": lambda scales: 0.03}, sign=0)
    mission = VARIED

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """The drivers go on believing the nominal one."""
        numbers.radius[wheel] *= parameters[0]
