"""Flaws of what is measured, not of the robot."""

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


@plant_effect("sensor.supply_scale")
class SupplyScale(PlantEffect):
    """Measured power of the whole robot is off by a factor."""

    def shape(self, design: PlantDesign) -> None:
        design.total_scale = float(self.values("scale", absent=1.0)[0])


@plant_effect("sensor.encoder_scale")
class EncoderScale(PlantEffect):
    """Encoders count more or less than a turn has counts."""

    def shape(self, design: PlantDesign) -> None:
        design.encoder_scale = self.values("scale", absent=1.0)


@plant_effect("sensor.encoder_eccentricity")
class EncoderEccentricity(PlantEffect):
    """Discs of encoders are off their axles' centres."""

    def shape(self, design: PlantDesign) -> None:
        design.encoder_center = np.stack([self.values("cosine"), self.values("sine")], axis=1)
