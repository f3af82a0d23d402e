"""The encoder of a wheel is cut off."""

from tomr_sim_bridge.faults.base import WHEEL_SPEC, Fault, FaultActions, register, severity_spec


@register
class EncoderLost(Fault):
    """Wang 2024, section 3.2: the encoder's data line is cut, so it reads standstill.

    The speed loop of the driver and the published joint state see the same frozen position.
    """

    fault_id = "encoder_lost"
    description = "encoder of a wheel lost"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; 1: position frozen; between: share of the counts that is lost"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.encoder[self.wheel] *= 1.0 - self.severity
        return True
