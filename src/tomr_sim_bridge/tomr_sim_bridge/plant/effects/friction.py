"""Resistance in bearings, gears and rotors."""

import numpy as np

from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.effects.base import PlantEffect, WheelLoads, plant_effect


@plant_effect("friction.coulomb")
class Coulomb(PlantEffect):
    """torque * sign(omega) [N m]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._torque = self.values("torque")

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._torque


@plant_effect("friction.viscous")
class Viscous(PlantEffect):
    """coefficient * omega [N m]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._coefficient = self.values("coefficient")

    def resist(self, loads: WheelLoads) -> None:
        loads.viscous += self._coefficient


@plant_effect("friction.stribeck")
class Stribeck(PlantEffect):
    """torque * exp(-(omega / speed)^2) * sign(omega) [N m]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._torque = self.values("torque")
        self._speed = self.values("speed", absent=1.0)

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._torque * np.exp(-((loads.speed / self._speed) ** 2))


@plant_effect("friction.asymmetric")
class Asymmetric(PlantEffect):
    """torque * sign(omega), more one way than the other [N m]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._torque = self.values("torque")

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._torque * np.sign(loads.speed)


@plant_effect("friction.load_dependent")
class LoadDependent(PlantEffect):
    """coefficient * abs(transmitted torque) * sign(omega) [N m], of the stretch before."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._coefficient = self.values("coefficient")

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._coefficient * np.abs(loads.transmitted)


@plant_effect("friction.quadratic")
class Quadratic(PlantEffect):
    """coefficient * omega * abs(omega) [N m]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._coefficient = self.values("coefficient")

    def resist(self, loads: WheelLoads) -> None:
        loads.viscous += self._coefficient * np.abs(loads.speed)


@plant_effect("drivetrain.torque_ripple")
class TorqueRipple(PlantEffect):
    """torque * sin(order * theta + phase) [N m], opposing positive motion."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._torque = self.values("torque")
        self._order = self.values("order")
        self._phase = self.values("phase")

    def resist(self, loads: WheelLoads) -> None:
        loads.torque -= self._torque * np.sin(self._order * loads.angle + self._phase)


@plant_effect("electrical.iron_loss")
class IronLoss(PlantEffect):
    """A torque of the rotor: hysteresis + eddy * motor speed [N m at the shaft]."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        gear = np.array([motor.gear_ratio for motor in robot.motors])
        self._dry = self.values("hysteresis") * gear
        self._viscous = self.values("eddy") * gear**2

    def resist(self, loads: WheelLoads) -> None:
        loads.dry += self._dry
        loads.viscous += self._viscous
