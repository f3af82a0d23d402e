"""Iron loss of the motors."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    Wheel,
    effect,
)
from tomr_power_model.effects.missions import VARIED


@effect
class IronLoss(Effect):
    """hysteresis * |motor speed| + eddy * motor speed^2, acting as a torque of the rotor."""

    effect_id = "electrical.iron_loss"
    label = "The motors' iron loses power"
    parameters = MappingProxyType(
        {
            "hysteresis": EffectParameter("W s/rad", prior_std=0.01),
            "eddy": EffectParameter("W s^2/rad^2", prior_std=1e-4),
        }
    )
    prior = HypothesisPrior(
        {
            "hysteresis": lambda scales: 0.3 * scales.torque / scales.gear,
            "eddy": lambda scales: 0.3 * scales.torque / scales.speed / scales.gear**2,
        },
        # It brakes as Coulomb and viscous friction together do, which every robot has.
        stands_for=("friction.coulomb", "friction.viscous"),
        log_prior=-3.0,
    )
    shown_by = "steady speeds under several loads: empty and with a payload"
    mission = VARIED
    # It brakes the rotor exactly as Coulomb and viscous friction do.
    in_currents = False

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Eddy currents damp."""
        numbers.viscous[wheel] += parameters[1] * numbers.gear_ratio[wheel] ** 2

    @staticmethod
    def dry_torque(hysteresis: float, eddy: float, wheel: Wheel) -> float:
        """Limit [N m]."""
        return hysteresis * wheel.gear_ratio
