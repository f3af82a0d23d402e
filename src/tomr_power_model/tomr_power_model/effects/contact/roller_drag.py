"""Drag of the rollers."""

from types import MappingProxyType

from tomr_power_model.effects.base import (
    Effect,
    EffectParameter,
    HypothesisPrior,
    PlantNumbers,
    effect,
)
from tomr_power_model.effects.missions import FINE_HEADINGS


@effect
class RollerDrag(Effect):
    """A force coefficient * N_i against the sliding of wheel i's contact.

    With slip 0 the contact slides along its axle only: the contract's effect. A wheel that turns
    faster than it travels slides in its rolling direction too; `slip` is (r omega - v) / v with
    the travel v. Dry friction points against the whole sliding, so that along the axle acts

        coefficient N_i u / sqrt(u^2 + (slip r omega)^2)

    with u the sliding along the axle [m/s] as the wheels show it; the rest is part of traction.
    """

    effect_id = "contact.roller_drag"
    label = "The rollers drag"
    parameters = MappingProxyType(
        {
            "coefficient": EffectParameter("", start=0.2, prior_std=0.3),
            "slip": EffectParameter("", maximum=10.0, default=0.0, start=0.3, prior_std=0.3),
        }
    )
    prior = HypothesisPrior(
        {"coefficient": lambda scales: 0.5 * scales.torque / (scales.load * scales.radius)},
        # The contract's law, and dry friction against sliding in the rolling direction as well.
        lambda scales: [{}, {"slip": 0.4}],
    )
    shown_by = "straight drives at many headings, 15 degrees apart"
    mission = FINE_HEADINGS
    needs_load = True

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Drag is a contact force, solved for with those that hold."""
        numbers.axle_drag[wheel] += parameters[0]
        numbers.roller_slip[wheel] += parameters[1]
