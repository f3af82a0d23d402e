"""Modelled power at the measured instants, as a function of the values that are fitted."""

from collections.abc import Callable, Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.samples import CHANNELS, TOTAL, Samples, motor_power
from tomr_power_model.dynamics.drives import InverseDynamics, WheelMotion
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_STILL = 0.15  # rad/s
_DRY = ("friction.coulomb", "friction.stribeck", "contact.rolling_resistance")


def modelled_power(robot: Robot, motion: WheelMotion, parts: int = 1) -> Array:
    """Power of motors 1-3 and of the whole robot [W] as it would be measured, (n, 4).

    The mean over each `parts` rows of the motion: the power sensor's window.
    """
    drives = InverseDynamics.of(robot).power(motion)
    power = drives.power
    if robot.measurement.quantity == "motor_current":
        power = motor_power(robot, drives.current, motion.speed)
    elif not robot.measurement.signed:
        power = np.abs(power)
    rows = np.empty((len(power), CHANNELS))
    rows[:, :WHEELS] = power
    rows[:, TOTAL] = drives.power.sum(axis=1) + robot.supply.auxiliary_power
    return _means(rows, parts)


def _means(rows: Array, parts: int) -> Array:
    return rows if parts == 1 else np.asarray(rows.reshape(-1, parts, CHANNELS).mean(axis=1))


def determined(samples: Samples, robot: Robot) -> Array:
    """Measured power without that of standing wheels that may hold any torque, (n, 4) [W].

    Where a wheel stops in dry friction, the sum of its driver's errors goes on holding a voltage.
    """
    dry = any(robot.effect(effect, wheel) for effect in _DRY for wheel in range(WHEELS))
    if not (robot.controller.integral and dry):
        return samples.measured
    held = np.abs(samples.mean_motion.speed) < _STILL
    unknown = np.column_stack([held, held.any(axis=1)])
    return np.where(unknown, np.nan, samples.measured)


@frozen
class Problem:
    """Recordings to be explained by one robot."""

    described: ParameterisedRobot
    parameters: tuple[Parameter, ...]
    samples: tuple[Samples, ...]
    _motion: WheelMotion = field(init=False)
    measured: Array = field(init=False)  # W, (n, 4) of all recordings together

    def __attrs_post_init__(self) -> None:
        joined = WheelMotion(
            np.concatenate([item.motion.speed for item in self.samples]),
            np.concatenate([item.motion.acceleration for item in self.samples]),
        )
        object.__setattr__(self, "_motion", joined)
        described = self.described.robot
        measured = np.concatenate([determined(item, described) for item in self.samples])
        object.__setattr__(self, "measured", measured)

    def robot(self, numbers: Sequence[float] | Array) -> Robot:
        """The robot with these values."""
        keys = (parameter.keys[0] for parameter in self.parameters)
        return self.described.given(dict(zip(keys, numbers, strict=True))).robot

    def residual(self, numbers: Sequence[float] | Array) -> Array:
        """Measured minus modelled power [W], (n, 4), NaN where nothing was measured."""
        # All recordings in one call, but windows of their own: encoders may differ in rate.
        points = modelled_power(self.robot(numbers), self._motion)
        ends = np.cumsum([len(item.motion.speed) for item in self.samples])[:-1]
        parts = zip(np.split(points, ends), self.samples, strict=True)
        modelled = np.concatenate([_means(rows, item.parts) for rows, item in parts])
        return np.asarray(self.measured - modelled)

    def jacobian(
        self, numbers: Array, step: Array, count: Callable[[], None] = lambda: None
    ) -> Array:
        """Derivative of the modelled power by each value, (n, 4, p), by central differences."""
        columns = []
        for index, width in enumerate(step):
            upper, lower = numbers.copy(), numbers.copy()
            upper[index] = min(numbers[index] + width, self.parameters[index].upper)
            lower[index] = max(numbers[index] - width, self.parameters[index].lower)
            change = self.residual(lower) - self.residual(upper)
            columns.append(change / (upper[index] - lower[index]))
            count()
        return np.stack(columns, axis=-1)
