"""Switching loss of the drivers."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, effect
from tomr_power_model.effects.missions import VARIED


@effect
class SwitchingLoss(Effect):
    """coefficient * |motor current|."""

    effect_id = "electrical.switching_loss"
    label = "The drivers lose power in switching"
    parameters = MappingProxyType({"coefficient": EffectParameter("W/A", prior_std=0.5)})
    prior = HypothesisPrior({"coefficient": lambda scales: 0.3 * scales.power / scales.current})
    shown_by = "steady speeds under several loads: empty and with a payload"
    mission = VARIED
    in_currents = False

    @staticmethod
    def driver_power(coefficient: float, current: float) -> float:
        """Lost in the driver [W]."""
        return coefficient * abs(current)
