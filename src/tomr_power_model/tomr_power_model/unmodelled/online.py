"""Learnt terms beside a simulation that goes on tick by tick."""

from collections.abc import Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.unmodelled.motion import LONG_AGO, RESTED, STANDING, Motion, contacts_at
from tomr_power_model.unmodelled.term import LearntTerm

Array = NDArray[np.float64]


@frozen
class Besides:
    """What terms do in a tick."""

    torque: Sequence[float] = (0.0, 0.0, 0.0)  # that resists at the wheels [N m]
    driver: Sequence[float] = (0.0, 0.0, 0.0)  # drawn besides by the drivers [W]
    supply: float = 0.0  # drawn besides at the supply [W]
    outside: tuple[str, ...] = ()  # families of the terms that are beyond their tables


NOTHING = Besides()


@frozen
class _Memory:
    """Where the robot has come to."""

    time: float = 0.0  # s
    x: float = 0.0  # m
    y: float = 0.0
    speed: Array = field(factory=lambda: np.zeros(3))  # of the wheels [rad/s]
    since: Array = field(factory=lambda: np.full(3, LONG_AGO))  # s
    stood: Array = field(factory=lambda: np.full(3, LONG_AGO))  # s
    turned: Array = field(factory=lambda: np.full(3, LONG_AGO))  # rad
    place: Array = field(factory=lambda: np.full(3, np.inf))  # angles at which they last rested


class OnlineTerms:
    """What terms do, from the motion at the start of each tick; they change slowly."""

    def __init__(self, terms: Sequence[LearntTerm], inverse: Array, tick_s: float) -> None:
        self._terms = terms
        self._inverse = inverse
        self._tick = tick_s
        self.clear()

    def clear(self) -> None:
        """Start anew: the world is where the robot stands."""
        self._memory = _Memory()

    def over(
        self,
        speed: Sequence[float],
        current: Sequence[float],
        angle: Sequence[float],
        heading: float,
    ) -> Besides:
        """What they do in the tick that begins with wheel speeds [rad/s], motor currents [A],
        wheel angles [rad] and a heading [rad].
        """
        wheels, angles = np.array(speed, dtype=np.float64), np.array(angle, dtype=np.float64)
        vx, vy, wz = self._inverse @ wheels
        middle = heading + 0.5 * wz * self._tick
        cos, sin = np.cos(middle), np.sin(middle)
        velocity = cos * vx - sin * vy, sin * vx + cos * vy
        self._memory = now = _gone_on(self._memory, self._tick, velocity, wheels, angles)
        contact_x, contact_y = contacts_at(
            self._inverse, np.array([now.x]), np.array([now.y]), np.array([middle])
        )
        motion = Motion(
            time=_body(now.time),
            speed=wheels[None],
            current=np.array([current], dtype=np.float64),
            angle=angles[None],
            heading=_body(middle),
            x=_body(now.x),
            y=_body(now.y),
            contact_x=contact_x,
            contact_y=contact_y,
            velocity_x=_body(velocity[0]),
            velocity_y=_body(velocity[1]),
            direction=_body(float(np.arctan2(vy, vx))),
            since_stand=now.since[None],
            turned=now.turned[None],
            from_rest=np.minimum(np.abs(angles - now.place), LONG_AGO)[None],
            to_wheels=self._inverse.T,
        )
        found = [term.actions(motion) for term in self._terms]
        return Besides(
            _summed([item.torque[0] for item in found]),
            _summed([item.driver[0] for item in found]),
            sum(float(item.supply[0]) for item in found),
            tuple(term.family.family_id for term in self._terms if term.outside(motion) > 0.0),
        )


def _gone_on(
    before: _Memory, tick: float, velocity: tuple[float, float], wheels: Array, angles: Array
) -> _Memory:
    """After a tick [s] at a velocity in the world [m/s], wheel speeds [rad/s] and angles [rad]."""
    slow = np.abs(wheels) < STANDING
    # A wheel that has turned about stood in between.
    moves = ~slow & (wheels * before.speed >= 0.0)
    stood = np.where(slow, before.stood + tick, 0.0)
    turned = np.minimum(before.turned + tick * np.abs(wheels), LONG_AGO)
    return _Memory(
        before.time + tick,
        before.x + tick * velocity[0],
        before.y + tick * velocity[1],
        wheels,
        np.where(moves, np.minimum(before.since + tick, LONG_AGO), 0.0),
        stood,
        np.where(stood < RESTED, turned, 0.0),
        np.where(stood < RESTED, before.place, angles),
    )


def _body(value: float) -> Array:
    """Of the whole robot, in one tick."""
    return np.array([[value]])


def _summed(rows: Sequence[Array]) -> list[float]:
    found: list[float] = np.sum(rows, axis=0).tolist()
    return found
