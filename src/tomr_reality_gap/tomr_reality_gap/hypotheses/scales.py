"""How large an effect may reasonably be on a robot, from what it does in a recording."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, timing_of, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.effects.scales import Scales
from tomr_power_model.robot import GRAVITY, Robot

Array = NDArray[np.float64]

_TRACTION_PARTS = (1.0, 0.8, 0.64, 0.51, 0.41, 0.33, 0.26)  # of what the contacts carry at most


def traction_ratios_of(robot: Robot, speed: Array, period: float) -> tuple[float, ...]:
    """The largest traction over load of any wheel that rolls, and parts of it, falling.

    Args:
        robot: whose wheels roll.
        speed: of its wheels in each period [rad/s], (n, 3).
        period: s.
    """
    p = laid_out(vehicle_of(robot))
    wheels = wheel_records(p)
    to_twist = wheels[:, at.TO_TWIST : at.TO_TWIST + 3]
    twist = speed @ to_twist
    # In a turning frame a momentum changes by omega x m v besides.
    vx, vy, wz = twist.T
    x, y = vx - wz * p[at.CENTER_Y], vy + wz * p[at.CENTER_X]
    turning = np.stack([-y, x, p[at.CENTER_X] * x + p[at.CENTER_Y] * y], axis=1)
    force = np.gradient(twist, period, axis=0) @ p[at.INERTIA : at.INERTIA + 9].reshape(3, 3)
    force += p[at.MASS] * wz[:, None] * turning
    traction = np.abs(force @ to_twist.T) / robot.wheel_radius
    most = float(np.max(traction / wheels[:, at.LOAD]))
    return tuple(part * most for part in _TRACTION_PARTS)


def scales_of(
    robot: Robot,
    speed: Array,
    power: Array,
    copper: Array,
    *,
    duration: float,
    currents: Sequence[Array] = (),
) -> Scales:
    """Scales from simulated wheel speeds [rad/s], powers and copper losses [W], each (n, 3).

    Measured `currents` [A] count where they are larger: what is left out may be most of it.
    """
    motor = robot.motors[0]
    loss = float(np.mean(copper))
    if currents:
        loss = max(loss, motor.resistance * float(np.mean(np.concatenate(currents) ** 2)))
    moving = np.abs(speed) > 0.2
    typical = float(np.sqrt(np.mean(speed[moving] ** 2))) if moving.any() else 1.0
    current = float(np.sqrt(loss / motor.resistance))
    return Scales(
        torque=max(motor.wheel_constant * current, 1e-3),
        speed=typical,
        current=max(current, 1e-3),
        power=max(float(np.mean(np.abs(power))), 1e-2),
        copper=max(loss, 1e-4),
        load=robot.mass * GRAVITY / 3.0,
        radius=robot.wheel_radius,
        arm=robot.robot_radius,
        mass=robot.mass,
        gear=motor.gear_ratio,
        voltage=robot.supply.nominal_voltage,
        duration=duration,
        period=timing_of(robot.controller.rate).period,
    )
