"""Stribeck friction."""

import math
from types import MappingProxyType

from tomr_power_model.effects.base import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import CRAWL


@effect
class Stribeck(Effect):
    """tau = torque * exp(-(omega/speed)^2) * sign(omega), above Coulomb."""

    effect_id = "friction.stribeck"
    label = "Stribeck friction"
    parameters = MappingProxyType(
        {
            "torque": EffectParameter("N m", prior_std=0.2),
            "speed": EffectParameter("rad/s", 1e-4, neutral=1.0, start=1.0, prior_std=1.0),
        }
    )
    prior = HypothesisPrior(
        {"torque": lambda scales: 0.5 * scales.torque},
        lambda scales: [{"speed": part * scales.speed} for part in (0.06, 0.15, 0.4)],
    )
    shown_by = "crawling: steady speeds from 0.2 to 3 rad/s at the wheel"
    mission = CRAWL

    @staticmethod
    def dry_torque(torque: float, speed: float, wheel: Wheel) -> float:
        """Limit [N m]."""
        ratio = wheel.speed / speed
        return torque * math.exp(-ratio * ratio)
