"""What happens between wheel and floor."""

import numpy as np

from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects.base import PlantEffect, WheelLoads, plant_effect


@plant_effect("contact.slip")
class FloorFriction(PlantEffect):
    """Traction of a wheel limited to friction * N_i: the floor's friction coefficient."""

    def shape(self, design: PlantDesign) -> None:
        friction = self.values("friction")
        design.floor_friction = np.where(friction > 0, friction, design.floor_friction)


@plant_effect("contact.roller_drag")
class RollerDrag(PlantEffect):
    """A force coefficient * N_i [N] against the rolling of the rollers."""

    needs_normal_force = True

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._coefficient = self.values("coefficient")

    def resist(self, loads: WheelLoads) -> None:
        loads.roller_force += self._coefficient * loads.normal


@plant_effect("contact.rolling_resistance")
class RollingResistance(PlantEffect):
    """coefficient * N_i * wheel_radius * sign(omega) [N m]."""

    needs_normal_force = True

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._arm = self.values("coefficient") * robot.wheel_radius

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._arm * loads.normal


@plant_effect("kinematic.wheel_radius")
class WheelRadius(PlantEffect):
    """A wheel of another radius than the description's; the robot stays level."""

    def shape(self, design: PlantDesign) -> None:
        design.wheel_radius = design.wheel_radius * self.values("scale", absent=1.0)
