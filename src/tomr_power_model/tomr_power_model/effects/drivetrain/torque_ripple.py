"""Torque ripple."""

import math
from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, Wheel, effect
from tomr_power_model.effects.missions import VARIED


@effect
class TorqueRipple(Effect):
    """tau = torque * sin(order * theta + phase), theta the wheel angle; opposes positive motion."""

    effect_id = "drivetrain.torque_ripple"
    label = "Torque ripples with the wheel's angle"
    parameters = MappingProxyType(
        {
            "torque": EffectParameter("N m", prior_std=0.05),
            "order": EffectParameter("1/rev", 1e-2, neutral=1.0, start=1.0, prior_std=10.0),
            "phase": EffectParameter("rad", -1e2, 1e2),
        }
    )
    shown_by = "steady speeds at three levels or more, slow to fast, on every wheel"
    mission = VARIED

    @staticmethod
    def moving_torque(torque: float, order: float, phase: float, wheel: Wheel) -> float:
        """Torque against positive motion [N m]; none where the angle is not known."""
        angle = order * wheel.angle + phase
        return torque * math.sin(angle) if angle == angle else 0.0
