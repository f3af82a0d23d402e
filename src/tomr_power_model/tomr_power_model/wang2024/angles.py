"""Wang 2024, Eqs 12-17: friction factors by direction and mass centre, and the wheels' loads."""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import GRAVITY, WHEELS, Robot
from tomr_power_model.wang2024.coefficients import Coefficients

Array = NDArray[np.float64]

SECTOR = np.pi / 3.0  # the paper's symmetry of 60 degrees [rad]


@frozen
class MassCenter:
    """Where the mass centre is, in the paper's polar form (Fig. 1b)."""

    delta_R: float  # distance from the geometric centre [m]
    psi: float  # angle from the positive direction [rad], 0 where delta_R is 0

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Mass centre of a robot; its positive direction is the axle of wheel 1."""
        x, y, _ = robot.mass_center
        distance = float(np.hypot(x, y))
        psi = float(np.arctan2(y, x)) - robot.wheel_offset if distance else 0.0
        return cls(distance, psi)


def alpha(heading: Array) -> Array:
    """Angle between the direction of motion and the nearest positive direction [rad].

    `heading` [rad] counts from the axle of wheel 1. The paper's positive directions repeat every
    60 degrees; alpha runs from 0 on each to 30 degrees half-way between (Wang 2024, 2.4).
    """
    return np.abs((heading + SECTOR / 2.0) % SECTOR - SECTOR / 2.0)


def mu_prime(c: Coefficients, angle: Array) -> Array:
    """Friction factor that depends on the direction of motion [-]. Wang 2024, Eq. 12.

    mu' = [(2 L / L_R) mu_R + (L_R / L) mu_S] |sin 3 beta|, its beta read as alpha [rad].
    """
    factor = 2.0 * c.L / c.L_R * c.mu_R + c.L_R / c.L * c.mu_S
    return np.asarray(factor * np.abs(np.sin(3.0 * angle)))


def beta(mu_: float, angle: Array) -> Array:
    """Climbing angle [rad] of a direction alpha [rad]. Wang 2024, Eq. 13.

    beta = arctan(mu) sin|sin 3 alpha| (sin 3 alpha)^2
    """
    sine = np.sin(3.0 * angle)
    return np.asarray(np.arctan(mu_) * np.sin(np.abs(sine)) * sine**2)


def mu_1(c: Coefficients, center: MassCenter) -> float:
    """Friction factor of the wheels' rolling [-]. Wang 2024, Eq. 14, its sine as a magnitude.

    mu_1 = (L + delta_R) / (L_v + L_R) mu_R |sin 3 psi|
    """
    arm = (c.L + center.delta_R) / (c.L_v + c.L_R)
    return float(arm * c.mu_R * np.abs(np.sin(3.0 * center.psi)))


def mu_2(c: Coefficients, center: MassCenter) -> float:
    """Friction factor of the rollers [-]. Wang 2024, Eq. 15, its cosine as a magnitude.

    mu_2 = (L + delta_R) / (L + L_R) mu_S |cos 3 psi|
    """
    arm = (c.L + center.delta_R) / (c.L + c.L_R)
    return float(arm * c.mu_S * np.abs(np.cos(3.0 * center.psi)))


def mu(c: Coefficients, center: MassCenter) -> float:
    """Friction factor of the whole robot [-]. Wang 2024, Eq. 16, with R = L_R, delta_b = delta_R.

    mu = (R + delta_R) / (L_R + L_v) mu_R + 2 R (1/2 - (delta_b / L_R)^2) / (L + L_v) mu_S
    """
    R, delta_b = c.L_R, center.delta_R
    rolling = (R + center.delta_R) / (c.L_R + c.L_v) * c.mu_R
    return rolling + 2.0 * R * (0.5 - (delta_b / c.L_R) ** 2) / (c.L + c.L_v) * c.mu_S


def N_i(M: float, L_R: float, center: MassCenter) -> Array:
    """Normal force of each wheel on a level floor [N], shape (3,). In place of Wang 2024, Eq. 17.

    N_i = M g / 3 (1 + 2 delta_R / L_R cos psi_i), psi_i between wheel i and the mass centre.
    The printed N_i = (1 +- L / delta_R) sin psi_i has no unit and no value at delta_R = 0.
    """
    psi_i = 2.0 * np.pi * np.arange(WHEELS) / WHEELS - center.psi
    return np.asarray(M * GRAVITY / 3.0 * (1.0 + 2.0 * center.delta_R / L_R * np.cos(psi_i)))
