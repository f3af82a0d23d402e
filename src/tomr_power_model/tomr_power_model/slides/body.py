"""A rigid body on its contacts, as filters need it: rims instead of wheel speeds."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

STICKING = 0.01  # m/s, sliding below which the rollers' drag fades


class ContactBody(NamedTuple):
    """A robot's numbers; a named tuple, for numba compiles what takes one."""

    rows: Array  # rim speed per twist [-, -, m], (3, 3)
    to_twist: Array  # its inverse
    along: Array  # sliding along the axles per twist, (3, 3)
    load: Array  # N, (3,)
    inertia: Array  # (3, 3)
    mass: float  # kg
    center: Array  # of the mass [m], (2,)


def body_of(robot: Robot) -> tuple[ContactBody, Array]:
    """Numbers of a robot with its effects, as the dynamics have them, and the wheels' radii [m]."""
    p = laid_out(vehicle_of(robot))
    wheel = wheel_records(p)
    rows = wheel[:, at.ROLL : at.ROLL + 3] * wheel[:, at.RADIUS, None]
    body = ContactBody(
        rows=rows,
        to_twist=np.asarray(np.linalg.inv(rows), dtype=np.float64),
        along=wheel[:, at.ALONG : at.ALONG + 3].copy(),
        load=wheel[:, at.LOAD].copy(),
        inertia=p[at.INERTIA : at.INERTIA + 9].reshape(3, 3).copy(),
        mass=float(p[at.MASS]),
        center=p[[at.CENTER_X, at.CENTER_Y]],
    )
    return body, wheel[:, at.RADIUS].copy()


def moving_wrench(body: ContactBody, twist: Array, change: Array) -> Array:
    """Forces and moment that move the body as it moves [N, N, N m], (3,).

    twist: of the body in its own frame [m/s, m/s, rad/s]; change: of its components, per second.
    """
    turning = np.array([-twist[2] * twist[1], twist[2] * twist[0], 0.0])
    return np.asarray(body.inertia @ (change + turning))


def rolling_forces(body: ContactBody, drag: float, twist: Array, change: Array) -> Array:
    """Forces of contacts that grip on a level floor [N], (3,).

    twist and change: as above; drag: of the rollers, share of the load.
    """
    along = np.tanh(body.along @ twist / STICKING) * body.load
    needed = moving_wrench(body, twist, change) + drag * (along @ body.along)
    return np.asarray(body.to_twist.T @ needed)
