"""Rolling resistance."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import VARIED


@effect
class RollingResistance(Effect):
    """tau = coefficient * N_i * wheel_radius * sign(omega)."""

    effect_id = "contact.rolling_resistance"
    label = "Rolling resistance"
    parameters = MappingProxyType({"coefficient": EffectParameter("", prior_std=0.05)})
    prior = HypothesisPrior(
        {"coefficient": lambda scales: 0.5 * scales.torque / (scales.load * scales.radius)}
    )
    shown_by = "the same drives empty and with a payload"
    mission = VARIED
    needs_load = True

    @staticmethod
    def dry_torque(coefficient: float, wheel: Wheel) -> float:
        """Limit [N m]."""
        return coefficient * wheel.radius * wheel.load
