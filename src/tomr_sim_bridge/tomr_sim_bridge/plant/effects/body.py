"""Load, mass centre and slope."""

import math

import numpy as np

from tomr_power_model.robot import GRAVITY
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects.base import PlantEffect, plant_effect


@plant_effect("body.payload_mass")
class PayloadMass(PlantEffect):
    """Mass added at the mass centre [kg]."""

    def shape(self, design: PlantDesign) -> None:
        design.mass += float(self.values("mass")[0])


@plant_effect("body.mass_center_offset")
class MassCenterOffset(PlantEffect):
    """Mass centre displaced in the plane [m]."""

    def shape(self, design: PlantDesign) -> None:
        offset = np.array([self.values("x")[0], self.values("y")[0], 0.0])
        design.mass_center = design.mass_center + offset


@plant_effect("body.slope")
class Slope(PlantEffect):
    """Floor tilted: gravity leans by `angle` towards `azimuth` (downhill), both in rad."""

    def shape(self, design: PlantDesign) -> None:
        angle, azimuth = float(self.values("angle")[0]), float(self.values("azimuth")[0])
        down = np.array([math.cos(azimuth), math.sin(azimuth)]) * math.sin(angle)
        design.gravity = GRAVITY * np.array([*down, -math.cos(angle)])
