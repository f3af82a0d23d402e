"""The driver of a wheel gets no control signal."""

from tomr_power_model.robot.parameters import ParameterSpec
from tomr_sim_bridge.faults.base import WHEEL_SPEC, Fault, FaultActions, register, severity_spec


@register
class ControlSignalLost(Fault):
    """Wang 2024, section 3.1: the control signal to one motor is disconnected.

    At severity 1 the driver leaves the terminals open, so that the wheel coasts, or shorts them, so
    that the motor brakes; it draws standby power only. Below 1 the commanded voltage arrives scaled
    down.
    """

    fault_id = "control_signal_lost"
    description = "control signal to a wheel's driver lost"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; 1: no signal, motor without current; between: voltage scaled down"),
        ParameterSpec(
            "terminals",
            "what a driver without a signal makes of the motor's terminals",
            kind="str",
            default="open",
            choices=("open", "shorted"),
            read_only=False,
        ),
    )

    def apply(self, actions: FaultActions) -> bool:
        wheel = self.wheel
        actions.drive[wheel] *= 1.0 - self.severity
        if self.severity >= 1.0 and self.settings["terminals"] == "open":
            actions.connected[wheel] = False
        return True
