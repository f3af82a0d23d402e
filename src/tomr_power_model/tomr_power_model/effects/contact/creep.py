"""Creep: contacts that slide a little below their limit."""

from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, effect


@effect
class Creep(Effect):
    """Sliding of wheel i's contact, rim less ground, over the speed of the robot's travel.

        coefficient f (1 + growth f^2),   f = traction / N_i

    Rollers that drag or are soft let a wheel turn faster than it travels. Neither power nor
    encoders tell it: `tomr_odometry learn` finds it where the pose is known. It moves the odometry
    alone.
    """

    effect_id = "contact.creep"
    label = "Wheels creep"
    parameters = MappingProxyType(
        {
            "coefficient": EffectParameter("", start=0.5, prior_std=0.5),
            "growth": EffectParameter("", minimum=-2.0, default=0.0, prior_std=2.0),
            "uncertainty": EffectParameter("", default=0.0),
        }
    )
    shown_by = "drives with a known pose at many headings"
    needs_load = True
