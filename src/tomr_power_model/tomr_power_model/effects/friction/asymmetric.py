"""Friction that differs with direction."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import BOTH_WAYS


@effect
class Asymmetric(Effect):
    """torque is added to the resistance when omega > 0, taken from it when omega < 0."""

    effect_id = "friction.asymmetric"
    label = "Friction differs with the direction of turning"
    parameters = MappingProxyType({"torque": EffectParameter("N m", -1e3, prior_std=0.1)})
    prior = HypothesisPrior({"torque": lambda scales: 0.3 * scales.torque}, sign=0)
    shown_by = "the same straight both ways, at several headings"
    mission = BOTH_WAYS

    @staticmethod
    def dry_torque(torque: float, wheel: Wheel) -> float:
        """Change of the limit [N m]."""
        if wheel.speed > 0.0:
            return torque
        return -torque if wheel.speed < 0.0 else 0.0
