"""Gear meshing loss."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import SPEEDS


@effect
class LoadDependent(Effect):
    """tau = coefficient * |transmitted torque| * sign(omega)."""

    effect_id = "friction.load_dependent"
    label = "The gear loses a share of the torque it carries"
    parameters = MappingProxyType({"coefficient": EffectParameter("", maximum=1.0, prior_std=0.2)})
    prior = HypothesisPrior({"coefficient": lambda scales: 0.1})
    shown_by = "the same drives empty and with a payload"
    mission = SPEEDS

    @staticmethod
    def dry_torque(coefficient: float, wheel: Wheel) -> float:
        """Limit [N m]."""
        return coefficient * abs(wheel.transmitted)
