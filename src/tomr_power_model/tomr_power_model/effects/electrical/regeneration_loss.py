"""Braking power that is lost."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, effect
from tomr_power_model.effects.missions import VARIED


@effect
class RegenerationLoss(Effect):
    """Only the part `efficiency` of braking power returns to the supply."""

    effect_id = "electrical.regeneration_loss"
    label = "Braking energy is lost"
    parameters = MappingProxyType(
        {"efficiency": EffectParameter("", maximum=1.0, neutral=1.0, start=0.8, prior_std=0.3)}
    )
    prior = HypothesisPrior({"efficiency": lambda scales: 0.5}, sign=-1)
    shown_by = "hard braking from full speed"
    mission = VARIED
    in_currents = False

    @staticmethod
    def supplied(efficiency: float, power: float) -> float:
        """Power at the supply [W]."""
        return efficiency * power if power < 0.0 else power
