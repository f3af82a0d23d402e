"""Windings, drivers and supply."""

import numpy as np

from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects.base import DriverPower, PlantEffect, plant_effect

COPPER_TEMPERATURE_COEFFICIENT = 0.00393  # 1/K


@plant_effect("electrical.winding_heating")
class WindingHeating(PlantEffect):
    """Winding resistance grows with a temperature rise [K] that copper loss feeds."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._thermal_resistance = self.values("thermal_resistance")
        self._time_constant = self.values("time_constant", absent=1.0)
        self._cold = np.array([motor.resistance for motor in robot.motors])
        self._rise = self.values("initial")

    def bill(self, drivers: DriverPower) -> None:
        copper = drivers.current**2 * drivers.resistance
        settled = copper * self._thermal_resistance
        self._rise += (settled - self._rise) * drivers.duration / self._time_constant
        drivers.resistance = self._cold * (1.0 + COPPER_TEMPERATURE_COEFFICIENT * self._rise)


@plant_effect("electrical.supply_sag")
class SupplySag(PlantEffect):
    """Internal resistance of the supply [ohm]."""

    def shape(self, design: PlantDesign) -> None:
        design.supply_resistance = float(self.values("resistance")[0])


@plant_effect("electrical.regeneration_loss")
class RegenerationLoss(PlantEffect):
    """Only the share `efficiency` of braking power returns to the supply."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._efficiency = self.values("efficiency", absent=1.0)

    def bill(self, drivers: DriverPower) -> None:
        returned = np.minimum(drivers.motor_power, 0.0)
        drivers.power -= returned * (1.0 - self._efficiency)


@plant_effect("electrical.switching_loss")
class SwitchingLoss(PlantEffect):
    """coefficient * abs(motor current) [W]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._coefficient = self.values("coefficient")

    def bill(self, drivers: DriverPower) -> None:
        drivers.power += self._coefficient * np.abs(drivers.current)


@plant_effect("electrical.driver_standby")
class DriverStandby(PlantEffect):
    """Constant power of each driver [W]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._power = self.values("power")

    def bill(self, drivers: DriverPower) -> None:
        drivers.power += self._power
