"""Matrices of a robot's rigid body on its wheels, as the dynamics have them."""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


@frozen
class Body:
    """Matrices of one robot with its effects on mass, mass centre and wheel radii."""

    to_twist: Array  # wheel speeds to body twist, (3, n)
    along: Array  # sliding in the rollers' free direction per body twist, (n, 3)
    mass_matrix: Array  # at base_link, (3, 3)
    mass: float  # kg
    mass_center: tuple[float, float]  # m

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Of a description."""
        p = laid_out(vehicle_of(robot))
        wheels = wheel_records(p)
        return cls(
            to_twist=wheels[:, at.TO_TWIST : at.TO_TWIST + 3].T,
            along=wheels[:, at.ALONG : at.ALONG + 3],
            mass_matrix=p[at.INERTIA : at.INERTIA + 9].reshape(3, 3),
            mass=float(p[at.MASS]),
            mass_center=(float(p[at.CENTER_X]), float(p[at.CENTER_Y])),
        )

    @property
    def from_force(self) -> Array:
        """Body force (N, N, N m) to wheel torques [N m], (n, 3)."""
        return self.to_twist.T

    def coriolis(self, twist: Array) -> Array:
        """c(nu): the omega x v terms in the body frame [N, N, N m]; twist and result (k, 3)."""
        x, y = self.mass_center
        turning = self.mass * np.array([[0.0, 1.0, x], [-1.0, 0.0, y], [-x, -y, 0.0]])
        return np.asarray(twist[..., 2:] * (twist @ turning))
