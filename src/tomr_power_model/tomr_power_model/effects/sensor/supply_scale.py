"""The supply's own sensor: its scale is off."""

import math
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
class SupplyScale(Effect):
    """The sensor of the whole robot reports `scale` times the power."""

    effect_id = "sensor.supply_scale"
    place = "supply"
    label = "The scale of the supply's sensor is off"
    parameters = MappingProxyType(
        {"scale": EffectParameter("", 1e-2, 1e2, neutral=1.0, start=1.0, prior_std=0.1)}
    )
    prior = HypothesisPrior({"scale": lambda scales: 0.1}, sign=0, log_prior=-math.log(10.0))
    shown_by = "the power of each motor beside that of the whole robot"
    mission = VARIED
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of the sensor, not of the robot."""
        numbers.supply_scale *= parameters[0]
