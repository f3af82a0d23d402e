"""Coulomb friction."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import SPEEDS


@effect
class Coulomb(Effect):
    """tau = torque * sign(omega)."""

    effect_id = "friction.coulomb"
    label = "Coulomb friction"
    parameters = MappingProxyType({"torque": EffectParameter("N m", prior_std=0.5)})
    prior = HypothesisPrior({"torque": lambda scales: 0.5 * scales.torque})
    shown_by = "steady speeds at three levels or more, slow to fast, on every wheel"
    mission = SPEEDS

    @staticmethod
    def dry_torque(torque: float, wheel: Wheel) -> float:
        """Limit [N m]."""
        return torque
