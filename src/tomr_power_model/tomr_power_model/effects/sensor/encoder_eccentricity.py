"""The disc of an encoder is off the axle's centre."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import VARIED

_MOST = 0.5  # the disc is round the axle still


@effect
class EncoderEccentricity(Effect):
    """The wheel turns (1 + cosine * cos(angle) + sine * sin(angle)) times as fast as its encoder
    shows, angle the one shown: once a turn too slow and once too fast.
    """

    effect_id = "sensor.encoder_eccentricity"
    label = "An encoder's disc is off its centre"
    parameters = MappingProxyType(
        {
            "cosine": EffectParameter("", -_MOST, _MOST, default=0.0, prior_std=0.02),
            "sine": EffectParameter("", -_MOST, _MOST, default=0.0, prior_std=0.02),
        }
    )
    prior = HypothesisPrior({"cosine": lambda scales: 0.02, "sine": lambda scales: 0.02}, sign=0)
    shown_by = "steady speeds at three levels or more, slow to fast, on every wheel"
    mission = VARIED

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of what the driver and joint_states see."""
        x, y = numbers.encoder_eccentricity[wheel]
        numbers.encoder_eccentricity[wheel] = x + parameters[0], y + parameters[1]
