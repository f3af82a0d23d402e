"""The floor is slippery, everywhere or on a patch."""

import numpy as np

from tomr_power_model.robot.parameters import ParameterSpec
from tomr_sim_bridge.faults.base import Fault, FaultActions, register, setting_spec, severity_spec

SLIPPERIEST = 0.02  # traction coefficient at severity 1: lubricated


def _place(name: str, description: str, minimum: float = -1e4) -> ParameterSpec:
    return setting_spec(name, description, "m", 0.0, minimum, 1e4)


@register
class FloorSlippery(Fault):
    """Wang 2024, section 3.3: lubricated floor.

    The traction coefficient falls by equal factors with severity, from the floor's own at 0 to
    0.02 at 1.
    """

    fault_id = "floor_slippery"
    description = "floor slippery"
    parameters = (
        severity_spec("0: off; 1: traction coefficient 0.02; between: by equal factors"),
        _place("center_x", "centre of the slippery patch in the world"),
        _place("center_y", "centre of the slippery patch in the world"),
        _place("radius", "of the slippery patch; 0: everywhere", minimum=0.0),
    )

    def apply(self, actions: FaultActions) -> bool:
        radius = self.number("radius")
        center = np.array([self.number("center_x"), self.number("center_y")])
        inside = np.full(len(actions.friction), True)
        if radius > 0:
            inside = np.hypot(*(actions.contact - center).T) <= radius
        fall = np.minimum(SLIPPERIEST / actions.friction, 1.0) ** self.severity
        actions.friction = np.where(inside, actions.friction * fall, actions.friction)
        return bool(inside.any())
