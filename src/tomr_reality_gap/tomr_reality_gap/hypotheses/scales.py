"""How large an effect may reasonably be on a robot, from what it does in a recording."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import GRAVITY, Robot

Array = NDArray[np.float64]


@frozen
class Scales:
    """Typical sizes of one robot in one recording."""

    torque: float  # N m at a wheel
    speed: float  # rad/s of a wheel, while it moves
    current: float  # A of a motor
    power: float  # W of a motor
    copper: float  # W of a motor
    load: float  # N on a wheel
    radius: float  # m, of a wheel
    arm: float  # m, robot radius
    mass: float  # kg
    gear: float
    voltage: float  # V
    duration: float  # s
    period: float  # of the drivers [s]


def scales_of(robot: Robot, speed: Array, power: Array, copper: Array, duration: float) -> Scales:
    """Scales from simulated wheel speeds [rad/s], powers and copper losses [W], each (n, 3)."""
    motor = robot.motors[0]
    moving = np.abs(speed) > 0.2
    typical = float(np.sqrt(np.mean(speed[moving] ** 2))) if moving.any() else 1.0
    current = float(np.sqrt(np.mean(copper) / motor.resistance))
    return Scales(
        torque=max(motor.wheel_constant * current, 1e-3),
        speed=typical,
        current=max(current, 1e-3),
        power=max(float(np.mean(np.abs(power))), 1e-2),
        copper=max(float(np.mean(copper)), 1e-4),
        load=robot.mass * GRAVITY / 3.0,
        radius=robot.wheel_radius,
        arm=robot.robot_radius,
        mass=robot.mass,
        gear=motor.gear_ratio,
        voltage=robot.supply.nominal_voltage,
        duration=duration,
        period=1.0 / robot.controller.rate,
    )
