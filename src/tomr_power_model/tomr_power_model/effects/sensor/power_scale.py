"""A power sensor's scale is off."""

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
class PowerScale(Effect):
    """A wheel's monitor reports `scale` times the power."""

    effect_id = "sensor.power_scale"
    label = "A power sensor's scale is off"
    parameters = MappingProxyType(
        {"scale": EffectParameter("", 1e-2, 1e2, neutral=1.0, start=1.0, prior_std=0.1)}
    )
    prior = HypothesisPrior({"scale": lambda scales: 0.1}, sign=0)
    mission = VARIED
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of the sensor, not of the robot."""
        numbers.power_scale[wheel] *= parameters[0]
