"""Wang 2024, Eqs 3-11 as powers: the derivatives in time of the energies.

What the paper says of a wheel goes to its motor, what it says of the robot is shared among the
motors by the speed of their wheels: every function of the motion system returns (n, 3) [W], and
the sum over its wheels is the paper's equation. v_i is the magnitude of a wheel's speed
throughout. docs/wang2024.md lists what is printed otherwise.
"""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.wang2024.angles import beta, mu, mu_1, mu_2, mu_prime
from tomr_power_model.wang2024.coefficients import Coefficients
from tomr_power_model.wang2024.state import V_STILL, State

Array = NDArray[np.float64]

# Between standing and a steady drive lies the "specific" state of Eq. 11 [m/s^2].
DV_STEADY = 0.1


def root(speed: Array, degree: int) -> Array:
    """speed^(1/degree) for speed >= 0 [m/s], linear below V_STILL where the slope would be
    infinite."""
    floor = np.maximum(speed, V_STILL)
    return np.asarray(floor ** (1.0 / degree) * (np.maximum(speed, 0.0) / floor))


def inverse_root(speed: Array, degree: int) -> Array:
    """speed^(-1/degree) [(s/m)^(1/degree)], falling to zero at rest below V_STILL, where it would
    be infinite."""
    floor = np.maximum(speed, V_STILL)
    return np.asarray(floor ** (-1.0 / degree) * (np.maximum(speed, 0.0) / floor))


def E_k(M: float, v: Array) -> Array:
    """Kinetic energy added [J] at speed v [m/s]. Wang 2024, Eq. 5."""
    return M * v**2 / 2.0


def P_k(s: State, c: Coefficients) -> Array:
    """dE_k/dt = M v dv/dt by wheel [W]. Wang 2024, Eq. 5.

    Each wheel gives its part of the force that accelerates M, times its own speed.
    """
    return s.P_accelerating * (1.0 + c.M_rot_ours / s.M)


def P_h(s: State, c: Coefficients) -> Array:
    """dE_h/dt, thermal dissipation by wheel [W]. Wang 2024, Eq. 6."""
    started = (c.t - c.t_0) / c.t
    of_robot = c.lambda_h * started * inverse_root(s.v - c.v_0, 6)
    of_robot = of_robot + c.R_T * (c.T - c.T_0) ** 2 * root(s.v - c.v_0, 2)
    return np.asarray(
        c.k_1h * s.Mg * s.v_i
        + c.k_T * s.F_wheel
        + s.share * of_robot[:, None]
        + c.k_2h * s.Mg * s.v_i**2
    )


def P_f(s: State, c: Coefficients, climbing: Array | None = None) -> Array:
    """dE_f/dt, friction by wheel [W]. Wang 2024, Eqs 7 and 12-16.

    The direction-dependent mu' of Eq. 12 adds to mu sin(beta) of the whole robot. `climbing`
    [rad], (n,): beta, if it is not to come from Eq. 13.
    """
    if climbing is None:
        climbing = beta(mu(c, s.center), s.alpha)
    factor = mu(c, s.center) * np.sin(climbing) + mu_prime(c, s.alpha)
    # A roller's drag acts along its wheel's axle: the other motors overcome it.
    rollers = mu_2(c, s.center) * (s.N_i * s.v_i_prime).sum(axis=1)
    return np.asarray(
        s.share * (factor * s.Mg * s.v + rollers)[:, None]
        + np.array(c.mu_i) * s.N_i * s.v_i * np.sin(s.alpha)[:, None]
        + mu_1(c, s.center) * s.N_i * s.v_i
    )


def P_i(s: State, c: Coefficients) -> Array:
    """dE_i/dt, iron loss by wheel [W]. Wang 2024, Eq. 8.

    |dv| is held at the largest that the fit has seen: a sixth power means nothing beyond.
    """
    dv = np.minimum(np.abs(s.dv), c.dv_max_ours)
    of_robot = (
        c.eps_1 * dv**6
        + c.eps_4 * root(s.v_i.sum(axis=1) - c.v_0, 6)
        + c.eps_3 * s.dv_i.sum(axis=1) ** 2
        + c.eps_2 * root(s.v - c.v_0, 2)
    )
    return np.asarray(s.share * of_robot[:, None])


def P_m(s: State, c: Coefficients) -> Array:
    """dE_m/dt, mechanical loss by wheel [W]. Wang 2024, Eq. 9."""
    sine = np.sin(s.alpha)
    return np.asarray(
        c.c_1_ours * s.N_i * s.v_i * sine[:, None]
        + c.k_1m * s.F_wheel**2
        + s.share * (c.c_2_ours * s.Mg * s.v * sine)[:, None]
        + c.k_2m * s.omega * s.F_wheel
    )


def P_running(s: State, c: Coefficients, climbing: Array | None = None) -> Array:
    """dE_running/dt by wheel [W]. Wang 2024, Eq. 4."""
    return P_k(s, c) + P_h(s, c) + P_f(s, c, climbing) + P_i(s, c) + P_m(s, c)


def P_motion(s: State, c: Coefficients, climbing: Array | None = None) -> Array:
    """dE_motion/dt by wheel [W]: standby and running. Wang 2024, Eqs 2 and 3."""
    return np.array(c.P_stanby) + P_running(s, c, climbing)


def P_sensor(s: State, c: Coefficients) -> Array:
    """dE_sensor/dt of all sensors [W], (n,). Wang 2024, Eq. 10."""
    return np.full_like(s.v, c.P_sensor)


def P_control(s: State, c: Coefficients) -> Array:
    """dE_control/dt [W], (n,): at rest, while speeds change, steady. Wang 2024, Eq. 11."""
    changes = np.abs(s.dv_i).sum(axis=1) + np.abs(s.dv)
    at_rest = np.maximum(s.v, s.v_i.max(axis=1)) < V_STILL
    stanby = np.full_like(s.v, c.P_stanby_c)
    spec = c.rho_1 * (changes + s.v) + c.P_stanby_c + c.p_fs * s.v / c.v_max
    stable = np.full_like(s.v, c.P_fs + c.rho_2 * c.t**0.1 + c.P_stanby_c)
    return np.select([at_rest, changes > DV_STEADY], [stanby, spec], stable)


def P_robot(s: State, c: Coefficients) -> Array:
    """dE_robot/dt [W], (n,): motion, control and sensors. Wang 2024, Eq. 1."""
    return np.asarray(P_motion(s, c).sum(axis=1) + P_control(s, c) + P_sensor(s, c))


def energy(power: Array, time: Array) -> Array:
    """Energy since the first instant [J]: the integral of a power [W] over time [s], (n, ...)."""
    steps = np.diff(time).reshape(-1, *[1] * (power.ndim - 1))
    pieces = 0.5 * (power[1:] + power[:-1]) * steps
    return np.concatenate([np.zeros_like(power[:1]), np.cumsum(pieces, axis=0)])
