"""A learnt term: a table over one or two variables, linear between its knots.

Beyond its table it fades to nothing within one knot's distance: it says nothing of where it has not
been.
"""

import math
from itertools import product

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.unmodelled.base import UNITS, Family
from tomr_power_model.unmodelled.motion import Motion

Array = NDArray[np.float64]

_ROUNDING = 1e-9


@frozen
class Actions:
    """What terms do in a drive of n periods."""

    torque: Array  # that resists at the wheels [N m], (n, 3)
    driver: Array  # power drawn besides by the drivers [W], (n, 3)
    supply: Array  # power drawn besides at the supply alone [W], (n,)


@frozen(eq=False)
class LearntTerm:
    """One term of a family, at some wheels (none: body or supply)."""

    family: type[Family]
    wheels: tuple[int, ...]
    knots: tuple[Array, ...]  # along each axis
    values: Array  # (rows, knots of all axes): of each wheel, all, x and y of a force [N], or one

    @property
    def unit(self) -> str:
        """Of the values."""
        return UNITS[self.family.acts]

    @staticmethod
    def rows(family: type[Family], wheels: int) -> int:
        """Rows of a table's values, for as many wheels."""
        return {"force": 2, "supply": 1}.get(family.acts, 1 if family.is_shared else wheels)

    def actions(self, motion: Motion) -> Actions:
        """What it does in a drive."""
        n, wheels = motion.speed.shape
        torque, driver, supply = np.zeros((n, wheels)), np.zeros((n, wheels)), np.zeros(n)
        coordinates, factor = self.family.coordinates(motion), self.family.factor(motion)
        factor = np.broadcast_to(factor, (n, wheels))
        if self.family.acts == "force":
            pushes = [self._at(component, coordinates[:, 0]) for component in self.values]
            torque = motion.resisting(pushes[0], pushes[1])
        elif self.family.acts == "supply":
            supply = factor[:, 0] * self._at(self.values[0], coordinates[:, 0])
        else:
            found = torque if self.family.acts == "torque" else driver
            rows = np.broadcast_to(self.values, (len(self.wheels), self.values.shape[1]))
            for wheel, values in zip(self.wheels, rows, strict=True):
                at = _of_place(coordinates, wheel)
                found[:, wheel] = factor[:, wheel] * self._at(values, at)
        return Actions(torque, driver, supply)

    def _at(self, values: Array, at: Array) -> Array:
        """Nothing where the variables are not known."""
        known = np.all(np.isfinite(at), axis=1, keepdims=True)
        found = value_at(self.family, self.knots, values, np.where(known, at, 0.0))
        return np.where(known[:, 0], found, 0.0)

    def outside(self, motion: Motion) -> float:
        """Share of a drive that lies beyond the table, where the term acts."""
        ones = np.ones(math.prod(len(points) for points in self.knots))
        coordinates = self.family.coordinates(motion)
        found = [
            (self._at(ones, at) < 1.0 - _ROUNDING) & np.all(np.isfinite(at), axis=1)
            for at in (_of_place(coordinates, wheel) for wheel in self.wheels or (0,))
        ]
        return float(np.mean(found))


def _of_place(coordinates: Array, wheel: int) -> Array:
    """Those of a wheel, or of the body where wheels share them, (n, axes)."""
    return coordinates[:, min(wheel, coordinates.shape[1] - 1)]


def value_at(family: type[Family], knots: tuple[Array, ...], values: Array, at: Array) -> Array:
    """A table (k,), or several of them (k, r), at some coordinates (m, axes), (m,) or (m, r)."""
    wide = (..., *(None for _ in values.shape[1:]))
    corners = _corners(family, knots, at)
    return np.asarray(sum(weight[wide] * values[index] for index, weight in corners))


def _corners(
    family: type[Family], knots: tuple[Array, ...], at: Array
) -> list[tuple[NDArray[np.intp], Array]]:
    """The knots around some coordinates, as indices into the table, with their weights, (m,)."""
    found = [(np.zeros(len(at), dtype=np.intp), np.ones(len(at)))]
    for number, (axis, points) in enumerate(zip(family.axes, knots, strict=True)):
        sides = _beside(points, at[:, number], axis.is_periodic)
        found = [
            (index * len(points) + own, weight * part)
            for index, weight in found
            for own, part in sides
        ]
    return found


def _beside(
    knots: Array, at: Array, is_periodic: bool
) -> tuple[tuple[NDArray[np.intp], Array], tuple[NDArray[np.intp], Array]]:
    """The two knots beside each value with their weights; beyond the last one they fade."""
    count = len(knots)
    if is_periodic:
        place = np.mod(at, 2.0 * np.pi) * count / (2.0 * np.pi)
        low = np.floor(place).astype(np.intp)
        share = place - low
        return (low % count, 1.0 - share), ((low + 1) % count, share)
    place = (at - knots[0]) / (knots[1] - knots[0])
    inside = np.clip(place, 0.0, count - 1.0)
    low = np.minimum(np.floor(inside).astype(np.intp), count - 2)
    share, fade = inside - low, np.clip(1.0 - np.abs(place - inside), 0.0, 1.0)
    return (low, (1.0 - share) * fade), (low + 1, share * fade)


def smoothness(family: type[Family], knots: tuple[Array, ...], length: float) -> Array:
    """Prior covariance of a table's values, of variance 1: Gaussian over `length` knots, (k, k)."""
    places = np.array(list(product(*(np.arange(len(points)) for points in knots))), dtype=float)
    apart = places[:, None] - places[None]
    for number, axis in enumerate(family.axes):
        if axis.is_periodic:
            count = len(knots[number])
            apart[..., number] = (apart[..., number] + count / 2) % count - count / 2
    square = (apart**2).sum(axis=-1)
    return np.asarray(np.exp(-0.5 * square / length**2) + 1e-3 * np.eye(len(places)))
