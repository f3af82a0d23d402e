"""What an effect without a name depends on: smooth torques of one variable, as columns.

A probe is a torque that resists motion at one wheel, a bump of a variable of the motion. If bumps
of a variable explain what all named effects together leave, something depends on that variable;
and what they amount to can be laid on another drive.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.unmodelled import Motion

Array = NDArray[np.float64]

_BUMPS = 10
_LOWEST = (1.0, 2.0, 3.0, 4.0)  # harmonics
_MOST_HARMONICS = 10
_ALONE = 0.1  # orders closer than this are one
_ACROSS = 3  # bumps along each side of the floor
_LEAST_FLOOR = 0.2  # m: who goes no farther sees no floor
PLACE = "place on the floor [m]"


Variable = Callable[[Motion], tuple[Array, Array]]  # its values, and the sign of the torque

_SMOOTH: Mapping[str, Variable] = MappingProxyType(
    {
        "wheel speed [rad/s]": lambda m: (np.abs(m.speed), m.sign),
        "signed wheel speed [rad/s]": lambda m: (m.speed, np.abs(m.sign)),
        "time [s]": lambda m: (m.time, m.sign),
        "motor current [A]": lambda m: (np.abs(m.current), m.sign),
    }
)
_PERIODIC: Mapping[str, Variable] = MappingProxyType(
    {
        "wheel angle [rad]": lambda m: (m.angle, np.ones_like(m.sign)),
        "direction of travel [rad]": lambda m: (m.direction, m.sign),
        "heading [rad]": lambda m: (m.heading, m.sign),
    }
)


@frozen
class Family:
    """Torques that depend on one variable."""

    variable: str  # with its unit
    knots: Array  # tops of the bumps, orders of a cosine and a sine each, or x of places, (k,)
    across: Array  # y of places, (k,); else empty
    width: tuple[float, float]  # of the bumps, in x and y of places

    @property
    def is_periodic(self) -> bool:
        return self.variable in _PERIODIC

    def at(self, values: Array) -> Array:
        """Each bump or wave at values of the variable, (k, ...)."""
        wide = self.knots.reshape(-1, *(1 for _ in values.shape))
        if self.is_periodic:
            shift = np.where(np.arange(len(self.knots)) % 2 == 0, 0.0, 0.5 * np.pi)
            return np.asarray(np.cos(wide * values - shift.reshape(wide.shape)))
        return np.asarray(np.exp(-0.5 * ((values - wide) / self.width[0]) ** 2))

    def torques(self, motion: Motion) -> Array:
        """Per unit of size, of each bump, driver period and wheel, (k, n, 3)."""
        if self.variable == PLACE:
            along = self.at(motion.x)
            side = (motion.y - self.across[:, None, None]) / self.width[1]
            return np.asarray(along * np.exp(-0.5 * side**2) * motion.sign)
        values, sign = {**_SMOOTH, **_PERIODIC}[self.variable](motion)
        return np.asarray(self.at(values) * sign)


def families(motions: Sequence[Motion], orders: Sequence[float] = ()) -> tuple[Family, ...]:
    """All families over the motions of one robot.

    Args:
        motions: in its recordings.
        orders: of wheel angles at which power was seen to swing [1/rev].
    """
    none = np.empty(0)
    found = []
    for name, variable in _SMOOTH.items():
        parts = [variable(motion) for motion in motions]
        shape = [np.broadcast_shapes(values.shape, sign.shape) for values, sign in parts]
        values = np.concatenate(
            [np.broadcast_to(v, s).ravel() for (v, _), s in zip(parts, shape, strict=True)]
        )
        moves = np.abs(np.concatenate([sign.ravel() for _, sign in parts])) > 0.5
        knots = _between(values[moves] if moves.any() else values, 0.01, 0.99, _BUMPS)
        found.append(Family(name, knots, none, (_apart(knots), 1.0)))
    for name in _PERIODIC:
        chosen = _harmonics(orders) if name.startswith("wheel angle") else _LOWEST
        found.append(Family(name, np.repeat(np.array(chosen), 2), none, (1.0, 1.0)))
    return (*found, *_places(motions))


def _harmonics(orders: Sequence[float]) -> tuple[float, ...]:
    """The lowest, and those that were seen with twice as many; none twice."""
    found = list(_LOWEST)
    for order in (times * order for order in orders for times in (1.0, 2.0)):
        if len(found) < _MOST_HARMONICS and min(abs(order - one) for one in found) > _ALONE:
            found.append(order)
    return tuple(found)


def _places(motions: Sequence[Motion]) -> tuple[Family, ...]:
    """Bumps over the floor, three by three; none for who hardly goes anywhere."""
    x, y = (np.concatenate([getattr(m, name)[:, 0] for m in motions]) for name in "xy")
    if min(np.ptp(x), np.ptp(y)) < _LEAST_FLOOR:
        return ()
    rows, columns = _between(x, 0.1, 0.9, _ACROSS), _between(y, 0.1, 0.9, _ACROSS)
    width = _apart(rows), _apart(columns)
    return (Family(PLACE, np.repeat(rows, _ACROSS), np.tile(columns, _ACROSS), width),)


def _apart(knots: Array) -> float:
    return max(float(knots[1] - knots[0]), 1e-9)


def _between(values: Array, low: float, high: float, count: int) -> Array:
    """Even knots between two quantiles."""
    first, last = float(np.quantile(values, low)), float(np.quantile(values, high))
    return np.linspace(first, last, count)
