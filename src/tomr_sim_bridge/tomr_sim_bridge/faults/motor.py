"""A motor that is not what it was."""

from tomr_sim_bridge.faults.base import (
    WHEEL_SPEC,
    Fault,
    FaultActions,
    register,
    severity_spec,
    size_spec,
)


@register
class MotorResistanceHigh(Fault):
    """Worn brushes, a corroded plug, a broken strand: resistance in series with the winding.

    Its heat arises there, so the winding does not grow warmer.
    """

    fault_id = "motor_resistance_high"
    description = "resistance of a motor's circuit too high"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; share of the rise"),
        size_spec("rise", "", 1.0, 20.0, "resistance added, as a share of the winding's"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.resistance[self.wheel] *= 1.0 + self.sized("rise")
        return True


@register
class MotorTorqueWeak(Fault):
    """Demagnetised: the torque constant falls, and the back-EMF with it."""

    fault_id = "motor_torque_weak"
    description = "torque constant of a motor too low"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; share of the loss"),
        size_spec("loss", "", 0.5, 0.95, "torque lost, as a share of the motor's"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.constant[self.wheel] *= 1.0 - self.sized("loss")
        return True
