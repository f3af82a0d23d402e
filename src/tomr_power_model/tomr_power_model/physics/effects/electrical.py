"""Effects between the motor terminals and the supply."""

import numpy as np
from attrs import frozen

from tomr_power_model.physics.effects.base import Array, Effect, effect

COPPER = 0.00393  # 1/K, growth of the winding resistance


@effect("electrical.driver_standby")
@frozen
class DriverStandby(Effect):
    """A constant power per driver (Wang 2024, Eq. 3)."""

    power: Array  # W

    def driver_power(self, current: Array) -> Array:
        return self.power


@effect("electrical.switching_loss")
@frozen
class SwitchingLoss(Effect):
    """coefficient * |motor current|."""

    coefficient: Array  # W/A

    def driver_power(self, current: Array) -> Array:
        return np.asarray(self.coefficient * np.abs(current))


@effect("electrical.regeneration_loss")
@frozen
class RegenerationLoss(Effect):
    """Only the part `efficiency` of braking power returns to the supply."""

    efficiency: Array

    def supplied(self, power: Array) -> Array:
        return np.where(power < 0.0, self.efficiency * power, power)


@effect("electrical.supply_sag")
@frozen
class SupplySag(Effect):
    """Supply voltage falls by `resistance` times the total current."""

    resistance: Array  # ohm

    def voltage_drop(self) -> Array:
        return np.asarray(self.resistance[..., 0])


@effect("electrical.winding_heating")
@frozen
class WindingHeating(Effect):
    """R grows by COPPER per kelvin of a hidden winding temperature T above 25 C.

    T' = (thermal_resistance * copper loss - T) / time_constant. Whoever steps through time
    integrates T, from `initial` on; beyond the contract, which starts at 0.
    """

    thermal_resistance: Array  # K/W
    time_constant: Array  # s
    initial: Array  # K
