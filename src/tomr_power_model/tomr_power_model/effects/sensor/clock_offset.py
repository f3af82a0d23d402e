"""A power sensor's clock is off."""

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
class ClockOffset(Effect):
    """The value that a monitor stamps t is that of t - delay."""

    effect_id = "sensor.clock_offset"
    label = "A power sensor's clock is off"
    parameters = MappingProxyType({"delay": EffectParameter("s", -10.0, 10.0, prior_std=0.05)})
    prior = HypothesisPrior(
        {"delay": lambda scales: 0.03},
        sign=0,
        least=lambda scales: scales.period,
    )
    mission = VARIED
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of the sensor, not of the robot [s]."""
        numbers.power_delay[wheel] += parameters[0]
