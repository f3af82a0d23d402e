"""The power sensor of a wheel misleads; the robot itself is well."""

from tomr_sim_bridge.faults.base import (
    WHEEL_SPEC,
    Fault,
    FaultActions,
    register,
    setting_spec,
    severity_spec,
)


@register
class PowerSensorDead(Fault):
    """Unplugged: no message comes, or NaN where several wheels share a message."""

    fault_id = "power_sensor_dead"
    description = "power sensor of a wheel silent"
    parameters = (WHEEL_SPEC, severity_spec("0: off; share of the readings that never come"))

    def apply(self, actions: FaultActions) -> bool:
        actions.meter_lost[self.wheel] = self.severity
        return True


@register
class PowerSensorFrozen(Fault):
    """Repeats the reading at which the fault began, under new stamps."""

    fault_id = "power_sensor_frozen"
    description = "power sensor of a wheel repeats itself"
    parameters = (WHEEL_SPEC, severity_spec("0: off; share of the old reading in each new one"))

    def apply(self, actions: FaultActions) -> bool:
        actions.meter_frozen[self.wheel] = self.severity
        return True


@register
class PowerSensorScaled(Fault):
    """A wrong shunt or gain."""

    fault_id = "power_sensor_scaled"
    description = "power sensor of a wheel off by a factor"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; how much of the way from 1 to the factor"),
        setting_spec("factor", "measured over true power, at severity 1", "", 0.5, -2.0, 10.0),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.meter_scale[self.wheel] *= 1.0 + self.severity * (self.number("factor") - 1.0)
        return True


@register
class PowerSensorBiased(Fault):
    """An offset that drifted."""

    fault_id = "power_sensor_biased"
    description = "power sensor of a wheel off by a constant"
    parameters = (
        WHEEL_SPEC,
        severity_spec("0: off; share of the bias"),
        setting_spec("bias", "measured less true power, at severity 1", "W", 4.0, -1e3, 1e3),
    )

    def apply(self, actions: FaultActions) -> bool:
        actions.meter_bias[self.wheel] += self.sized("bias")
        return True
