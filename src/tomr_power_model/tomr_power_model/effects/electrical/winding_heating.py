"""Heating of the windings."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import HARD_SPINS


@effect
class WindingHeating(Effect):
    """R grows 0.393 %/K with a hidden winding temperature T above 25 C.

    T' = (thermal_resistance * copper loss - T) / time_constant, from `initial` on, which is beyond
    the contract.
    """

    effect_id = "electrical.winding_heating"
    label = "The windings heat up"
    parameters = MappingProxyType(
        {
            "thermal_resistance": EffectParameter("K/W", prior_std=5.0),
            "time_constant": EffectParameter(
                "s", 1e-2, 1e6, neutral=100.0, start=100.0, prior_std=100.0
            ),
            "initial": EffectParameter("K", -100.0, 500.0, default=0.0, prior_std=20.0),
        }
    )
    prior = HypothesisPrior(
        {
            "thermal_resistance": lambda scales: 0.2 / 0.004 / scales.copper,
            "initial": lambda scales: 10.0,
        },
        lambda scales: [{"time_constant": part * scales.duration} for part in (0.15, 0.5, 1.5)],
    )
    shown_by = "hard acceleration for minutes, then a rest and the same again"
    mission = HARD_SPINS

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """The temperature is part of the state."""
        numbers.thermal_resistance[wheel] += parameters[0]
        numbers.thermal_time[wheel] = parameters[1]
        numbers.initial_rise[wheel] += parameters[2]
