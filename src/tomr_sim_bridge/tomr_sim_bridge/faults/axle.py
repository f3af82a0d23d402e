"""A wheel that turns with difficulty, or not at all."""

from tomr_sim_bridge.faults.base import (
    WHEEL_SPEC,
    Fault,
    FaultActions,
    register,
    severity_spec,
    size_spec,
)


@register
class BearingDragging(Fault):
    """Dry friction is added at the axle, so the motor draws torque * speed more, and its copper."""

    fault_id = "bearing_dragging"
    description = "bearing or brake of a wheel drags"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; share of the torque that is added"),
        size_spec("torque", "N m", 0.4, 5.0, "dry friction added at the axle"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.dry[self.wheel] += self.sized("torque")
        return True


@register
class WheelStuck(Fault):
    """A brake or a jammed gear holds the wheel with more than motor and floor can overcome.

    The other wheels drag it over the floor while its motor stalls. At a severity at which the
    motor (torque constant * voltage / resistance * gear ratio) is the stronger, it turns.
    """

    fault_id = "wheel_stuck"
    description = "wheel blocked"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; share of the torque that holds the wheel"),
        size_spec("torque", "N m", 40.0, 1000.0, "torque up to which the wheel is held"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.dry[self.wheel] += self.sized("torque")
        return True
