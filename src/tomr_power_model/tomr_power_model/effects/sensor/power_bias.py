"""A power sensor has an offset."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import STAND


@effect
class PowerBias(Effect):
    """A wheel's monitor reports `power` more than there is."""

    effect_id = "sensor.power_bias"
    label = "A power sensor has an offset"
    parameters = MappingProxyType({"power": EffectParameter("W", -1e4, 1e4, prior_std=3.0)})
    prior = HypothesisPrior({"power": lambda scales: 0.3 * scales.power}, sign=0)
    mission = STAND
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of the sensor, not of the robot [W]."""
        numbers.power_bias[wheel] += parameters[0]
