"""Coefficients of Wang 2024 from a healthy drive: bounded linear least squares."""

from collections.abc import Callable

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.errors import InputError
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.wang2024.angles import beta, mu
from tomr_power_model.wang2024.coefficients import Coefficients
from tomr_power_model.wang2024.state import V_STILL, Chassis, State, state_of
from tomr_power_model.wang2024.terms import P_control, P_motion, P_sensor

Array = NDArray[np.float64]

MOTOR_COEFFICIENTS = (
    "P_stanby",
    *("k_1h", "k_2h", "k_T", "lambda_h", "R_T"),
    *("mu_i", "mu_R", "mu_S"),
    *("eps_1", "eps_2", "eps_3", "eps_4"),
    *("k_1m", "k_2m", "c_1_ours", "c_2_ours"),
)
OTHER_COEFFICIENTS = ("P_sensor", "P_stanby_c", "rho_1", "rho_2", "p_fs", "P_fs")

# Several terms have one and the same shape (docs/wang2024.md): the data determine their sum, and
# this pull to zero, relative to a term's own size, makes them share it alike.
_RIDGE = 1e-4
_ROUNDS = 30
_SETTLED = 1e-10
_LEAST_MOVING = 100  # rows in which each wheel must turn


@frozen
class Samples:
    """A healthy drive: motion of the wheels and what was measured of it."""

    motion: WheelMotion  # (n, 3)
    power: Array  # of each motor [W], (n, 3)
    total: Array | None = None  # of the whole robot [W], (n,)

    def known(self) -> "Samples":
        """The rows in which nothing is missing."""
        rows = np.isfinite(self.motion.speed).all(axis=1) & np.isfinite(self.power).all(axis=1)
        rows &= np.isfinite(self.motion.acceleration).all(axis=1)
        yaw = self.motion.yaw_rate
        motion = WheelMotion(
            self.motion.speed[rows],
            self.motion.acceleration[rows],
            None if yaw is None else yaw[rows],
        )
        return Samples(motion, self.power[rows], None if self.total is None else self.total[rows])


def fit_wang2024(robot: Robot, samples: Samples, turning: bool = False) -> Coefficients:
    """Fit every coefficient that is not given by the robot; none is allowed below zero.

    The model is linear in all of them but for the climbing angle of Eq. 13, which follows from mu:
    the fit is repeated until it no longer changes. `turning` also fits what Eq. 5 leaves out, the
    energy of turning parts. Raises InputError for too little motion.
    """
    samples = samples.known()
    chassis = Chassis.of(robot)
    state = state_of(chassis, samples.motion)
    moving = (state.v_i > V_STILL).sum(axis=0)
    if moving.min() < _LEAST_MOVING:
        wheel = robot.wheel_names[int(moving.argmin())]
        raise InputError(
            f"{wheel} turns in only {moving.min()} samples, a fit needs {_LEAST_MOVING}: "
            "give a longer drive, in all directions"
        )
    fastest = float(np.abs(state.dv).max())
    given = Coefficients.of_robot(robot).having(M=state.M, dv_max_ours=fastest)
    names = (*MOTOR_COEFFICIENTS, "M_rot_ours") if turning else MOTOR_COEFFICIENTS
    motors = _fit_motors(given, names, state, samples.power)
    other = robot.supply.auxiliary_power
    if samples.total is None:
        return motors.having(P_sensor=other)
    rest = samples.total - samples.power.sum(axis=1)
    known = np.isfinite(rest)
    if not known.any():
        return motors.having(P_sensor=other)
    return _solve(motors, OTHER_COEFFICIENTS, lambda c: _other(state, c)[known], rest[known])


def _fit_motors(
    given: Coefficients, names: tuple[str, ...], state: State, power: Array
) -> Coefficients:
    factor = 0.0
    found = given
    for _ in range(_ROUNDS):
        climbing = beta(factor, state.alpha)

        def predicted(c: Coefficients, climbing: Array = climbing) -> Array:
            return P_motion(state, c, climbing)

        found = _solve(given, names, predicted, power)
        last, factor = factor, mu(found, state.center)
        if abs(factor - last) < _SETTLED:
            break
    return found


def _other(state: State, c: Coefficients) -> Array:
    return P_control(state, c) + P_sensor(state, c)


def _solve(
    given: Coefficients,
    names: tuple[str, ...],
    predicted: Callable[[Coefficients], Array],
    measured: Array,
) -> Coefficients:
    """Least squares over the named coefficients; `predicted` is linear in them."""
    units = [pair for name in names for pair in _units(given, name)]
    without = predicted(given)
    columns = np.stack(
        [(predicted(given.having(**{name: unit})) - without).ravel() for name, unit in units],
        axis=1,
    )
    size = np.linalg.norm(columns, axis=0)
    used = size > 0.0
    scaled = columns[:, used] / size[used]
    wanted = np.concatenate([(measured - without).ravel(), np.zeros(scaled.shape[1])])
    ridged = np.concatenate([scaled, _RIDGE * np.eye(scaled.shape[1])])
    rotation, reduced = np.linalg.qr(ridged)
    fitted = lsq_linear(reduced, rotation.T @ wanted, (0.0, np.inf), method="bvls")
    found = np.zeros(len(units))
    found[used] = np.maximum(fitted.x, 0.0) / size[used]  # bvls may end a rounding error below
    return _assigned(given, units, found)


def _units(given: Coefficients, name: str) -> list[tuple[str, float | tuple[float, ...]]]:
    """The coefficient at one and nothing else of it; by wheel where it is so."""
    if not isinstance(getattr(given, name), tuple):
        return [(name, 1.0)]
    return [(name, tuple(float(i == wheel) for i in range(WHEELS))) for wheel in range(WHEELS)]


def _assigned(
    given: Coefficients, units: list[tuple[str, float | tuple[float, ...]]], found: Array
) -> Coefficients:
    values: dict[str, float | tuple[float, ...]] = {}
    for (name, unit), number in zip(units, found, strict=True):
        if isinstance(unit, tuple):
            before = values.get(name, (0.0,) * WHEELS)
            assert isinstance(before, tuple)
            values[name] = tuple(
                old + float(number) * part for old, part in zip(before, unit, strict=True)
            )
        else:
            values[name] = float(number)
    return given.having(**values)
