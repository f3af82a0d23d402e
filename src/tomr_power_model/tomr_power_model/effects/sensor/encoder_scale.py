"""An encoder loses counts, or counts too many."""

import math
from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import VARIED


@effect
class EncoderScale(Effect):
    """A wheel's encoder shows `scale` times the angle turned: below 1 it loses counts."""

    effect_id = "sensor.encoder_scale"
    label = "An encoder loses counts, or counts too many"
    parameters = MappingProxyType({"scale": EffectParameter("", 0.1, 10.0, neutral=1.0, start=1.0)})
    # All but the losses in the windings is as with another wheel radius, which is the usual cause.
    prior = HypothesisPrior({"scale": lambda scales: 0.03}, sign=0, log_prior=-math.log(10.0))
    shown_by = "a reference of the pose, or the same wheel at two loads"
    mission = VARIED

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Of what the driver and joint_states see."""
        numbers.encoder_scale[wheel] *= parameters[0]
