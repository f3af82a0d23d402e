"""Friction with the square of speed."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import SPEEDS


@effect
class Quadratic(Effect):
    """tau = coefficient * omega * |omega|."""

    effect_id = "friction.quadratic"
    label = "Friction grows with the square of speed"
    parameters = MappingProxyType({"coefficient": EffectParameter("N m s^2/rad^2", prior_std=0.01)})
    prior = HypothesisPrior({"coefficient": lambda scales: 0.5 * scales.torque / scales.speed**2})
    shown_by = "steady speeds at three levels or more, slow to fast, on every wheel"
    mission = SPEEDS

    @staticmethod
    def moving_torque(coefficient: float, wheel: Wheel) -> float:
        """Torque against positive motion [N m]."""
        return coefficient * wheel.speed * abs(wheel.speed)
