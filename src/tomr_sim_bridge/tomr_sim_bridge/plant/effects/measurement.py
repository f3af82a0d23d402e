"""Flaws of the power measurement, not of the robot."""

import numpy as np

from tomr_power_model.errors import InputError
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects.base import PlantEffect, plant_effect


@plant_effect("sensor.power_scale")
class PowerScale(PlantEffect):
    """Measured power is off by a factor."""

    def shape(self, design: PlantDesign) -> None:
        design.power_scale = self.values("scale", absent=1.0)


@plant_effect("sensor.power_bias")
class PowerBias(PlantEffect):
    """Measured power is off by a constant [W]."""

    def shape(self, design: PlantDesign) -> None:
        design.power_bias = self.values("power")


@plant_effect("sensor.power_lag")
class PowerLag(PlantEffect):
    """Measured power follows with a time constant [s]."""

    def shape(self, design: PlantDesign) -> None:
        design.power_lag = self.values("time_constant")


@plant_effect("sensor.clock_offset")
class ClockOffset(PlantEffect):
    """The value stamped t is that of t - delay [s]."""

    def shape(self, design: PlantDesign) -> None:
        delay = self.values("delay")
        if np.any(delay < 0):
            raise InputError(
                f"physics.sensor.clock_offset: delay = {delay.min():g} s would need readings of "
                "the future: give a delay of 0 or more"
            )
        design.power_delay = delay
