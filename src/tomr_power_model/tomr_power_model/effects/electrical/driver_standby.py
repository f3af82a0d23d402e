"""Standby power of the drivers."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, effect
from tomr_power_model.effects.missions import STAND


@effect
class DriverStandby(Effect):
    """A constant power per driver (Wang 2024, Eq. 3)."""

    effect_id = "electrical.driver_standby"
    label = "The drivers draw standby power"
    parameters = MappingProxyType({"power": EffectParameter("W", maximum=1e4, prior_std=3.0)})
    prior = HypothesisPrior({"power": lambda scales: 0.5 * scales.power})
    shown_by = "standing still for ten seconds"
    mission = STAND
    in_currents = False

    @staticmethod
    def driver_power(power: float, current: float) -> float:
        """Lost in the driver [W]."""
        return power
