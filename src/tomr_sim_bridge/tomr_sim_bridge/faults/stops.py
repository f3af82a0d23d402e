"""The robot does not do what it is commanded, for a reason that lies with no wheel."""

from tomr_sim_bridge.faults.base import Fault, FaultActions, register, severity_spec


@register
class DriversOff(Fault):
    """All bridges are off at severity 1 and the wheels coast; the drivers draw standby power only.

    Below 1 all bridges give that much less voltage.
    """

    fault_id = "drivers_off"
    description = "all drivers off (emergency stop)"
    parameters = (severity_spec("0: off; 1: motors without current; between: voltage scaled down"),)

    def apply(self, actions: FaultActions) -> bool:
        actions.drive *= 1.0 - self.severity
        if self.severity >= 1.0:
            actions.connected[:] = False
        return True


@register
class CommandsIgnored(Fault):
    """A collision monitor, a multiplexer or a safety stop zeroes the commands.

    The drivers brake the robot to a halt and hold it; below severity 1 they drive that much slower
    than commanded.
    """

    fault_id = "commands_ignored"
    description = "commands do not reach the drivers (safety stop)"
    parameters = (severity_spec("0: off; share of the commanded twist that is withheld"),)

    def apply(self, actions: FaultActions) -> bool:
        actions.obedience *= 1.0 - self.severity
        return True
