"""What an effect without a name depends on: smooth torques of one variable, as columns.

A probe is a torque that resists motion at one wheel, a bump of a variable of the motion. If bumps
of a variable explain what all named effects together leave, something depends on that variable.
"""

from collections.abc import Mapping

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.forward import Forward

Array = NDArray[np.float64]

_BUMPS = 10
_HARMONICS = 4
_MOVING = 0.1  # rad/s: the sign of slower motion is not sure


@frozen
class Family:
    """Torques that depend on one variable."""

    variable: str  # with its unit
    knots: Array  # where the bumps have their tops, (k,)
    torque: Array  # per unit of size, of each bump, wheel and driver period, (k, count, 3)


def families(forward: Forward, robot: Robot, run: Mapping[str, Array]) -> tuple[Family, ...]:
    """All families, over the motion that a robot makes in a recording.

    Args:
        forward: the recording.
        robot: its description.
        run: of `forward.run(robot)`.
    """
    speed = run["speed"]
    line = forward.timeline
    time = line.start + line.period * (np.arange(line.count) + 0.5)
    sign = np.tanh(speed / _MOVING)
    twist = speed @ wheels_to_twist(robot).T
    heading = np.cumsum(run["yaw_rate"]) * line.period
    direction = np.arctan2(twist[:, 1], twist[:, 0])
    angle = np.cumsum(speed, axis=0) * line.period
    start = np.array(
        [
            np.interp(0.0, forward.recorded.encoder_time, column)
            for column in forward.recorded.position.T
        ]
    )
    angle = angle + np.where(np.isfinite(start), start, 0.0)
    current = np.sqrt(run["copper"])
    wide = np.broadcast_to
    shape = speed.shape
    return (
        _bumps("wheel speed [rad/s]", np.abs(speed), sign),
        _bumps("signed wheel speed [rad/s]", speed, np.abs(sign)),
        _turns("wheel angle [rad]", angle, np.ones(shape)),
        _bumps("time [s]", wide(time[:, None], shape), sign),
        _bumps("load current [sqrt W]", current, sign),
        _turns("direction of travel [rad]", wide(direction[:, None], shape), sign),
        _turns("heading [rad]", wide(heading[:, None], shape), sign),
        *_places(twist, heading, line.period, sign),
    )


def _bumps(variable: str, values: Array, factor: Array) -> Family:
    """Gaussian bumps at quantiles of a variable."""
    usual = np.abs(factor) > 0.5
    inside = values[usual] if usual.any() else values.ravel()
    knots = _between(inside, 0.01, 0.99, _BUMPS)
    width = max(float(knots[1] - knots[0]), 1e-9)
    torque = [np.exp(-0.5 * ((values - knot) / width) ** 2) * factor for knot in knots]
    return Family(variable, knots, np.stack(torque))


def _turns(variable: str, angle: Array, factor: Array) -> Family:
    """Harmonics of an angle; the constant is left to friction."""
    torque = [
        wave(order * angle) * factor
        for order in range(1, _HARMONICS + 1)
        for wave in (np.cos, np.sin)
    ]
    return Family(variable, np.repeat(np.arange(1.0, _HARMONICS + 1.0), 2), np.stack(torque))


def _places(twist: Array, heading: Array, period: float, sign: Array) -> tuple[Family, ...]:
    """Bumps over the floor, three by three, from dead reckoning."""
    cos, sin = np.cos(heading), np.sin(heading)
    x = np.cumsum(cos * twist[:, 0] - sin * twist[:, 1]) * period
    y = np.cumsum(sin * twist[:, 0] + cos * twist[:, 1]) * period
    if min(np.ptp(x), np.ptp(y)) < 0.2:  # m: it hardly goes anywhere
        return ()
    rows = _between(x, 0.1, 0.9, 3)
    columns = _between(y, 0.1, 0.9, 3)
    wide, high = max(np.ptp(rows) / 2.0, 1e-3), max(np.ptp(columns) / 2.0, 1e-3)
    torque = [
        np.exp(-0.5 * (((x - row) / wide) ** 2 + ((y - column) / high) ** 2))[:, None] * sign
        for row in rows
        for column in columns
    ]
    return (Family("place on the floor [m]", np.arange(9.0), np.stack(torque)),)


def _between(values: Array, low: float, high: float, count: int) -> Array:
    """Even knots between two quantiles."""
    first, last = float(np.quantile(values, low)), float(np.quantile(values, high))
    return np.linspace(first, last, count)
