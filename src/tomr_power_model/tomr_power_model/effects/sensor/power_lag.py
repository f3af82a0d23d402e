"""A power sensor lags."""

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
class PowerLag(Effect):
    """A wheel's monitor follows the power with a first-order lag."""

    effect_id = "sensor.power_lag"
    label = "A power sensor lags"
    parameters = MappingProxyType({"time_constant": EffectParameter("s", 0.0, 1e2, prior_std=0.1)})
    prior = HypothesisPrior(
        {"time_constant": lambda scales: 0.05},
        # Within a driver's period power is a sawtooth: timing finer than that is not known.
        least=lambda scales: scales.period,
    )
    mission = VARIED
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of the sensor, not of the robot [s]."""
        numbers.power_lag[wheel] += parameters[0]
