"""Rigid planar body on three wheels, seen from the wheels.

With omega = K nu the power balance gives F = K^T tau for wheel torques tau and body force F, so

    tau = K^-T (M nu_dot + c(nu) + drag) + J omega_dot + friction
"""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import wheel_angles, wheels_to_twist
from tomr_power_model.robot import GRAVITY, WHEELS, Robot

Array = NDArray[np.float64]


@frozen
class Body:
    """Matrices of one robot, effects on the body already applied."""

    to_twist: Array  # K^-1, (3, 3)
    from_force: Array  # K^-T, (3, 3): body force (N, N, N m) -> wheel torques
    mass_matrix: Array  # at base_link, (3, 3)
    wheel_inertia: Array  # wheel and rotor at the axle [kg m^2], (3,)
    normal: Array  # static wheel loads [N], (3,)
    axles: Array  # unit vectors along the axles, (3, 2)
    mass: float
    mass_center: tuple[float, float]
    turning: Array  # c(nu) = omega_z turning^T nu, (3, 3)

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Matrices of a robot whose body effects have been applied."""
        to_twist = wheels_to_twist(robot)
        x, y, _ = robot.mass_center
        m = robot.mass
        rotors = [motor.gear_ratio**2 * motor.rotor_inertia for motor in robot.motors]
        theta = wheel_angles(robot)
        return cls(
            to_twist=to_twist,
            from_force=to_twist.T,
            mass_matrix=np.array(
                [
                    [m, 0.0, -m * y],
                    [0.0, m, m * x],
                    [-m * y, m * x, robot.inertia_z + m * (x * x + y * y)],
                ]
            ),
            wheel_inertia=robot.wheel_inertia + np.array(rotors),
            normal=wheel_loads(robot),
            axles=np.stack([np.cos(theta), np.sin(theta)], axis=1),
            mass=m,
            mass_center=(x, y),
            turning=m * np.array([[0.0, 1.0, x], [-1.0, 0.0, y], [-x, -y, 0.0]]),
        )

    @property
    def wheel_mass_matrix(self) -> Array:
        """Inertia that the wheels feel, K^-T M K^-1 + diag(J) [kg m^2], (3, 3)."""
        carried = self.from_force @ self.mass_matrix @ self.to_twist
        return np.asarray(carried + np.diag(self.wheel_inertia))

    def turning_force(self, twist: Array) -> Array:
        """c(nu): the omega x v terms in the body frame [N, N, N m]; twist and result (n, 3)."""
        return np.asarray(twist[..., 2:] * (twist @ self.turning))


def wheel_loads(robot: Robot) -> Array:
    """Static normal force of each wheel on a level floor [N], shape (3,).

    Balance of forces and moments: sum N_i = m g, sum N_i p_i = m g p_mass_center.
    """
    theta = wheel_angles(robot)
    contacts = robot.robot_radius * np.stack([np.cos(theta), np.sin(theta)])
    balance = np.vstack([np.ones(WHEELS), contacts])
    x, y, _ = robot.mass_center
    loads = np.linalg.solve(balance, robot.mass * GRAVITY * np.array([1.0, x, y]))
    return np.asarray(loads, dtype=np.float64)
