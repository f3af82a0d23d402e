"""Quantities that state how bad a fault is: each a change, and what it is a share of.

A measure gives sum x^2 and sum x y of a tick, y being a change and x what it is a share of (1: it
has a unit of its own), for each wheel or for the robot as a whole.
"""

import math
from collections.abc import Callable

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import MOVES, Tick
from tomr_fault_diag.classifier.states import (
    BURDENED,
    CONTROL,
    DEGRADED,
    DRAGGING,
    LOW_SUPPLY,
    MOTOR,
    POWER_SENSOR,
    SLIP,
    STATES,
    STUCK,
    State,
)

Array = NDArray[np.float64]
Sums = tuple[Array, Array]  # of x^2 and of x y, one for each wheel or one alone

_FRICTION = 0.1  # of an axle's friction: what a description does not know of it
_DRIVES = 0.05  # m/s
_NOTHING: Sums = (np.zeros(1), np.zeros(1))


@frozen
class Measure:
    """A quantity that states how bad some states are."""

    quantity: str
    unit: str  # empty: a share
    sums: Callable[[Tick], Sums]
    states: tuple[State, ...]
    wheels: int = 3  # 1: of the robot as a whole
    is_absolute: bool = False  # a robot that is well shows it too
    doubt: Callable[[Motors], float] = lambda _: 0.0  # what a description leaves open


def _friction(tick: Tick) -> Sums:
    """Torque at a wheel that turns, beyond what its motion takes [N m]."""
    more = tick.motors.constant * (tick.current - tick.expected_current)
    ways = np.where(np.abs(tick.speed) > MOVES, np.sign(tick.speed), 0.0)
    return ways**2, ways * more


def _withstood(tick: Tick) -> Sums:
    """Torque of a motor whose wheel should turn [N m]."""
    ways = np.where(np.abs(tick.expected) > MOVES, np.sign(tick.expected), 0.0)
    return ways**2, ways * tick.motors.constant * tick.current


def _copper(tick: Tick) -> Sums:
    """Losses of a winding beyond those of its current: a share of its resistance."""
    losses = tick.motors.resistance * tick.expected_current**2 * (np.abs(tick.speed) > MOVES)
    if tick.motors.reports_currents:  # they do not show it
        losses = np.zeros_like(losses)
    return losses**2, losses * (tick.power - tick.from_encoders)


def _scale(tick: Tick) -> Sums:
    """Shown beyond what the encoders explain, as a share."""
    return tick.from_encoders**2, tick.from_encoders * (tick.power - tick.from_encoders)


def _drawn(tick: Tick) -> Sums:
    """Power beyond what the commanded motion takes, as a share of what drives the motor."""
    expected = tick.commanded - tick.motors.idle
    return expected**2, expected * (tick.power - tick.commanded)


def _speed(tick: Tick) -> Sums:
    """Wheel speed shown beyond what was commanded, as a share."""
    return tick.expected**2, tick.expected * (tick.speed - tick.expected)


def _traction(tick: Tick) -> Sums:
    """Force over load at the wheels that push hardest: weighted by its cube, as a share."""
    force = tick.motors.forces(tick.current, tick.speed, tick.change)
    force = np.abs(force) * (np.abs(tick.speed) > MOVES)
    return np.array([force**3 @ tick.motors.load]), np.array([force**3 @ force])


def _doubt(motors: Motors) -> float:
    """Of a traction, from the friction at the axles."""
    return float(np.mean(_FRICTION * motors.friction(1.0) / (motors.radius * motors.load)))


def _force(tick: Tick) -> Sums:
    """Force against the way that the robot moves [N]."""
    velocity = (tick.motors.to_twist @ tick.speed)[:2]
    speed = math.hypot(*velocity)
    if speed < _DRIVES:
        return _NOTHING
    more = tick.motors.constant * (tick.current - tick.expected_current)
    force = tick.motors.to_force @ more
    return np.ones(1), np.array([force[:2] @ velocity / speed])


def _supply(tick: Tick) -> Sums:
    """Voltage beyond the nominal one, as a share."""
    if tick.supply != tick.supply:
        return _NOTHING
    return np.ones(1), np.array([tick.supply - 1.0])


MEASURES: tuple[Measure, ...] = (
    Measure("friction added", "N m", _friction, DRAGGING),
    Measure("withstands", "N m", _withstood, STUCK, is_absolute=True),
    Measure("winding resistance, or a loss like it,", "", _copper, DEGRADED),
    Measure("power shown", "", _scale, POWER_SENSOR),
    Measure("motor power", "", _drawn, (STATES[CONTROL],)),
    Measure("wheel speed shown", "", _speed, STATES[MOTOR:]),
    Measure(
        "traction used",
        "of the load",
        _traction,
        (STATES[SLIP],),
        wheels=1,
        is_absolute=True,
        doubt=_doubt,
    ),
    Measure("resisting force", "N", _force, (BURDENED,), wheels=1),
    Measure("supply voltage", "", _supply, (LOW_SUPPLY,), wheels=1, is_absolute=True),
)
