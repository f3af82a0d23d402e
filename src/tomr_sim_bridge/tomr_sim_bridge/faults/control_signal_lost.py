"""The driver of a wheel gets no control signal."""

from tomr_sim_bridge.faults.base import WHEEL_SPEC, Fault, FaultActions, register, severity_spec


@register
class ControlSignalLost(Fault):
    """Wang 2024, section 3.1: the control signal to one motor is disconnected.

    The bridge is off at severity 1, so the wheel coasts and the driver draws its standby power
    only; below 1 the commanded voltage arrives scaled down.
    """

    fault_id = "control_signal_lost"
    description = "control signal to a wheel's driver lost"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; 1: no signal, motor without current; between: voltage scaled down"),
    )

    def apply(self, actions: FaultActions) -> bool:
        wheel = self.wheel
        actions.drive[wheel] *= 1.0 - self.severity
        if self.severity >= 1.0:
            actions.connected[wheel] = False
        return True
