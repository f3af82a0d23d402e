"""A plain refit: every parameter of the description, by bounded least squares.

The way of MuJoCo sysid: its optimiser (`mujoco.minimize.least_squares`, Gauss-Newton within bounds,
Jacobian by differences of simulations run as one batch), its 95 % intervals,

    x_j +- t sqrt(s^2 [(J^T J)^-1]_jj),   s^2 = |r|^2 / (n - p),

and its log, which warns of parameters at a bound. Residuals are weighted by the standard deviation
of what is left in each channel, found by fitting twice.
"""

from collections.abc import Sequence
from io import StringIO

import numpy as np
from attrs import evolve, frozen
from mujoco import minimize
from numpy.typing import NDArray
from scipy.special import stdtrit

from others.case import Case, nrmse, residuals
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import (
    Parameter,
    ParameterisedRobot,
    bounds_of,
    unit_of,
    wheel_key,
)
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import RecordingSimulation

Array = NDArray[np.float64]

_SHARED = ("robot.mass", "robot.inertia_z", "supply.auxiliary_power")
_OF_WHEELS = ("motor.resistance", "motor.torque_constant")
_OF_MOTORS = ("motor.rotor_inertia",)  # alike for the three
_LEAST, _MOST = 0.5, 2.0  # bounds, times the described value
_STEP = 1e-4  # of a value, for a derivative
_UNIT, _LATEST = 0.01, 0.5  # s, and of that: bound of the delay
_ROUNDS = 2  # weights from the description's residuals, then from the fit's
_AT_BOUND = 1e-3  # of the range, as MuJoCo sysid
_SINGULAR = 1e-15


@frozen
class Fit:
    """One parameter as refitted."""

    key: str  # of the description, by wheel where each has its own
    nominal: float
    value: float
    half_width: float  # of the 95 % interval
    unit: str
    at_bound: bool


@frozen
class Refit:
    """All parameters, and what they do to the held-out error."""

    fits: tuple[Fit, ...]
    before: float  # NRMSE of the description on the holdout
    after: float


def parameters_of(base: ParameterisedRobot, wheels: Sequence[str]) -> tuple[Parameter, ...]:
    """What is refitted: motors and physics of each wheel, the body, the auxiliary power.

    Held is what is known or would have no interval: geometry; the drivers' gains, which with
    torque constants and resistances scale each other; the wheels' inertia beside the rotors'.
    """
    single = [*_SHARED, *(wheel_key(name, wheel) for name in _OF_WHEELS for wheel in wheels)]
    single += [key for key in base.values if key.startswith("physics.")]
    groups: dict[str, tuple[str, ...]] = {key: (key,) for key in single}
    groups |= {name: tuple(wheel_key(name, wheel) for wheel in wheels) for name in _OF_MOTORS}
    found = []
    for name, keys in groups.items():
        value = base.values.get(keys[0])
        if isinstance(value, int | float) and value > 0.0:
            low, high = bounds_of(keys[0])
            low, high = max(_LEAST * value, low) - value, min(_MOST * value, high) - value
            unit, step = unit_of(keys[0]), _STEP * value
            found.append(Parameter(name, keys, unit, value, step=step, lower=low, upper=high))
    return tuple(found)


def refit(case: Case) -> Refit:
    """Refit a case on its recording and score it on its holdout."""
    parameters = parameters_of(case.base, case.robot.wheel_names)
    fits = fitted(case.real, case.base, parameters)
    changes = [fit.value - fit.nominal for fit in fits]
    robots = [case.base.robot, case.base.offset(parameters, changes).robot]
    values = case.held.predict(robots)
    before, after = (nrmse(case.held.channels, residuals(case.held, item)) for item in values)
    return Refit(fits, before, after)


def fitted(
    simulation: RecordingSimulation, base: ParameterisedRobot, parameters: Sequence[Parameter]
) -> tuple[Fit, ...]:
    """Parameters that bring the simulation closest to a recording; its delay is fitted besides."""
    measured = np.concatenate([item.value for item in simulation.channels])
    scale = np.array([parameter.prior_std for parameter in parameters])
    bounds = [
        np.append(1.0 + [getattr(parameter, side) for parameter in parameters] / scale, delay)
        for side, delay in (("lower", -_LATEST), ("upper", _LATEST))
    ]
    # Shares of the described values, and the delay.
    point = np.append(np.ones(len(parameters)), 0.0)
    weight = np.ones_like(measured)

    def residual(points: Array) -> Array:
        robots = [
            _later(base.offset(parameters, (column[:-1] - 1.0) * scale).robot, column[-1] * _UNIT)
            for column in points.T
        ]
        return np.asarray(((simulation.predict(robots) - measured) * weight).T)

    for _ in range(_ROUNDS):
        left = residual(point[:, None])[:, 0] / weight
        for part in rows_of(simulation.channels):
            weight[part] = 1.0 / max(float(np.std(left[part])), 1e-9)
        point, log = minimize.least_squares(
            point, residual, bounds, eps=_STEP, xtol=1e-4, mu_factor=10.0, x_scale="jac",
            verbose=minimize.Verbosity.FULLITER, output=StringIO(),
        )  # fmt: skip
    widths = half_widths(log[-1].residual[:, 0], log[-1].jacobian)[:-1] * scale
    near = _AT_BOUND * (bounds[1] - bounds[0])
    stuck = (point - bounds[0] < near) | (bounds[1] - point < near)
    return tuple(
        Fit(
            parameter.name,
            parameter.prior_std,
            parameter.prior_std * x,
            float(width),
            parameter.unit,
            bool(at),
        )
        for parameter, x, width, at in zip(
            parameters, point[:-1].tolist(), widths, stuck[:-1], strict=True
        )
    )


def _later(robot: Robot, delay: float) -> Robot:
    controller = robot.controller
    return evolve(robot, controller=evolve(controller, delay=controller.delay + delay))


def half_widths(residual: Array, jacobian: Array) -> Array:
    """Half the 95 % intervals from the Jacobian at the optimum; infinite where it shows nothing."""
    freedom = len(residual) - jacobian.shape[1]
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    blind = values <= _SINGULAR * values[-1]
    inverse = vectors[:, ~blind] ** 2 @ (1.0 / values[~blind])
    inverse[(vectors[:, blind] ** 2).sum(axis=1) > _SINGULAR] = np.inf
    return np.asarray(np.sqrt(inverse * (residual @ residual) / freedom) * stdtrit(freedom, 0.975))
