"""What the equations of Wang 2024 see of a motion."""

from typing import Self

import numpy as np
from attrs import Factory, evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.geometry.kinematics import wheel_radii
from tomr_power_model.robot import GRAVITY, Robot
from tomr_power_model.wang2024.angles import MassCenter, N_i, alpha

Array = NDArray[np.float64]

# Below this speed [m/s] signs and roots fade to zero: at rest encoders tremble, and a sixth root
# would make a third of its full value of a tremble of 1 mm/s.
V_STILL = 0.02


@frozen
class Chassis:
    """The constants of a robot that turn wheel motion into the paper's quantities."""

    body: Body
    r: Array  # wheel radii [m], (3,)
    positive: float  # heading of the positive direction: the axle of wheel 1 [rad]
    center: MassCenter
    N_i: Array  # normal forces [N], (3,)

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Of a description, with the payload and mass centre that its effects give it."""
        numbers = plant_numbers(vehicle_of(robot))
        x, y = numbers.mass_center
        physics = {key: at for key, at in robot.physics.items() if not key.startswith("body.")}
        center = (x, y, robot.mass_center[2])
        robot = evolve(robot, mass=numbers.mass, mass_center=center, physics=physics)
        mass_center = MassCenter.of(robot)
        return cls(
            body=Body.of(robot),
            r=wheel_radii(robot),
            positive=robot.wheel_offset,
            center=mass_center,
            N_i=N_i(robot.mass, robot.robot_radius, mass_center),
        )


@frozen
class State:
    """The paper's quantities over n instants; by wheel (n, 3), of the robot (n,)."""

    M: float  # mass [kg]
    N_i: Array  # normal force of each wheel [N], (3,)
    center: MassCenter
    v: Array  # speed of the robot [m/s], >= 0
    dv: Array  # its rate Delta v / Delta t [m/s^2]
    v_i: Array  # speed of each wheel's rim [m/s], >= 0
    dv_i: Array  # its rate Delta v_i / Delta t [m/s^2]
    v_i_prime: Array  # speed of each contact along its axle, where the rollers turn [m/s], >= 0
    omega: Array  # angular speed of each wheel [rad/s], >= 0
    alpha: Array  # direction of motion [rad], 0 to 30 degrees
    F_wheel: Array  # force of each wheel on the floor [N], >= 0
    P_accelerating: Array  # power of each wheel against the inertia of M [W], either sign
    # Of each wheel in what the paper says of the robot, (n, 3): an idle wheel takes no part, its
    # motor draws P_stanby alone (Wang 2024, 3.1).
    share: Array = field(init=False, default=Factory(lambda s: _share(s.v_i), takes_self=True))

    @property
    def Mg(self) -> float:
        """Weight [N]."""
        return self.M * GRAVITY


def _share(v_i: Array) -> Array:
    parts = v_i + 1e-6  # m/s: alike at rest
    return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def state_of(chassis: Chassis, motion: WheelMotion) -> State:
    """The paper's quantities of a wheel motion of n rows."""
    body, r = chassis.body, chassis.r
    twist = motion.speed @ body.to_twist.T
    if motion.yaw_rate is not None:
        seen = ~np.isnan(motion.yaw_rate)
        twist[seen, 2] = motion.yaw_rate[seen]
    rate = motion.acceleration @ body.to_twist.T
    v = np.hypot(twist[:, 0], twist[:, 1])
    force = rate @ body.mass_matrix.T + body.coriolis(twist)
    # Acceleration in the world: of the mass alone, without yaw inertia or offset of its centre.
    pull = np.zeros_like(twist)
    pull[:, 0] = body.mass * (rate[:, 0] - twist[:, 2] * twist[:, 1])
    pull[:, 1] = body.mass * (rate[:, 1] + twist[:, 2] * twist[:, 0])
    heading = np.arctan2(twist[:, 1], twist[:, 0]) - chassis.positive
    rim = r * motion.speed
    return State(
        M=body.mass,
        N_i=chassis.N_i,
        center=chassis.center,
        v=v,
        dv=(twist[:, :2] * rate[:, :2]).sum(axis=1) / np.maximum(v, V_STILL),
        v_i=np.abs(rim),
        dv_i=np.tanh(rim / V_STILL) * r * motion.acceleration,
        v_i_prime=np.abs(twist @ body.along.T),
        omega=np.abs(motion.speed),
        alpha=np.where(v > 0.0, alpha(heading), 0.0),
        F_wheel=np.abs(force @ body.from_force.T / r),
        P_accelerating=(pull @ body.from_force.T) * motion.speed,
    )
