"""The battery is flat, or a cell of it is dead."""

from tomr_sim_bridge.faults.base import Fault, FaultActions, register, severity_spec, size_spec


@register
class SupplyLow(Fault):
    """All bridges give less voltage than their drivers reckon with; it is measured."""

    fault_id = "supply_low"
    description = "supply voltage too low"
    parameters = (
        severity_spec("0: off; share of the voltage that is missing"),
        size_spec("undervoltage", "V", 8.0, 100.0, "voltage below the nominal one"),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.undervoltage += self.sized("undervoltage")
        return True
