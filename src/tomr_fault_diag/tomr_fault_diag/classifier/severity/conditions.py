"""How a robot that is well differs from its description, followed over minutes.

Windings heat, grease stiffens, a payload is put on, the floor is another: none is a fault. What
motors draw beyond what the encoders explain is fitted jointly by what such changes would add,

    P - P_e = s R i_e^2 + (omega + 2 R i_e / k) tau + R (tau / k)^2 + p,
    tau = sign(omega) f + m tau_move + n tau_turn,

with s a share of every winding's resistance, f friction [N m] and p standby power [W] of each
motor, and m and n a payload's mass and inertia as shares of the robot's, which take as much more of
the torques that move it and turn it; i - i_e = tau / k where currents are measured. Least squares
over the last five minutes of driving that were called normal, drawn to 0 by how much each may
change, with intervals of 95 % by the jackknife. What is reported is surer, for it is looked for all
the time, and windings only beyond what a payload's jerks may feign.

It is reported and nothing else: no residual is corrected by it, so that it can swallow no fault.
"""

from collections import deque
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.interval import Severity, jackknife_half
from tomr_fault_diag.classifier.severity.tick import MOVES, Tick
from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]

_LENGTH = 40  # ticks of a stretch: 8 s of driving at the rate of looks
_MOST = 40  # stretches that are remembered
_LEAST = 8  # that an interval needs
_ROUNDS = 3  # of the fit, for the square of tau

# A row: what one motor that turns shows in a tick.
_WHEEL, _LOSS, _GAIN, _SQUARE, _SIGN, _CARRIED, _TURNED, _SHOWN = range(8)

_TYPICAL = 5.0  # rad/s
_SLOWS = 1.0  # rad/s^2
_EVEN = 0.1  # of a current, and of that of friction
_JERKS = 0.5  # of a payload, that looks like hot windings
_WINDINGS, _PAYLOAD, _INERTIA = 0, 1, 2
_FRICTION, _STANDBY = 3, 3 + WHEELS  # of the first motor
_UNKNOWNS = 3 + 2 * WHEELS

# How much each may change: a share of the resistance, of the mass, of the friction; W.
_CHANGES = (0.5, 0.5, 1.0, 1.0)
# What is worth reporting, in the same units; a share of the nominal voltage.
_WORTH = (0.1, 0.1, 0.2, 0.5)
_WORTH_VOLTAGE = 0.05
_SURE = 1.5  # halves of an interval: eight unknowns are looked at again and again
_CONSTANTS = 0.05  # of what a description says of them: how well they are known


class ConditionsWatch:
    """Follows a robot that is called normal and says how it has changed."""

    def __init__(self, motors: Motors) -> None:
        friction = motors.friction(_TYPICAL)
        own = float(friction.mean())
        self._friction = friction / motors.constant  # A
        scales = np.array([1.0, 1.0, 1.0, *[own] * WHEELS, *[1.0] * WHEELS])
        kinds = [0, 1, 1, *[2] * WHEELS, *[3] * WHEELS]
        self._mass = motors.mass
        self._priors = np.array(_CHANGES)[kinds] * scales
        self._worth = np.array(_WORTH)[kinds] * scales
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._stretches: deque[Array] = deque(maxlen=_MOST)  # rows, (k, 8) each
        self._voltages: deque[float] = deque(maxlen=_MOST)  # of the supply, over the nominal one
        self._rows: list[Array] = []
        self._supplies: list[float] = []
        self.changes: tuple[Severity, ...] = ()

    def take(self, tick: Tick, last: Tick) -> None:
        """Take a tick of a robot that is called normal, and the one before; at rest none counts."""
        rows = _rows(tick, last, self._friction)
        if not len(rows):
            return
        self._rows.append(rows)
        if tick.supply == tick.supply:
            self._supplies.append(tick.supply)
        if len(self._rows) < _LENGTH:
            return
        self._stretches.append(np.concatenate(self._rows))
        if self._supplies:
            self._voltages.append(float(np.mean(self._supplies)))
        self._rows, self._supplies = [], []
        self.changes = (*self._of_supply(), *self._of_motors())

    def _of_supply(self) -> Iterator[Severity]:
        lacks = np.array(self._voltages) - 1.0
        count = len(lacks)
        if count >= _LEAST:
            others = (lacks.sum() - lacks) / (count - 1)
            half = float(jackknife_half(others))
            yield from _change("supply voltage", "", lacks.mean(), half, _WORTH_VOLTAGE)

    def _of_motors(self) -> Iterator[Severity]:
        if len(self._stretches) < _LEAST:
            return
        value, half = self._fitted()
        half = half + _CONSTANTS * np.abs(value)
        half[_WINDINGS] += _JERKS * abs(value[_PAYLOAD])
        for quantity, unit, place, size in (
            ("winding resistance", "", _WINDINGS, 1.0),
            ("payload", "kg", _PAYLOAD, self._mass),
            *((f"friction of motor {w + 1}", "N m", _FRICTION + w, 1.0) for w in range(WHEELS)),
            *((f"standby power of motor {w + 1}", "W", _STANDBY + w, 1.0) for w in range(WHEELS)),
        ):
            numbers = (size * number[place] for number in (value, half, self._worth))
            yield from _change(quantity, unit, *numbers)

    def _fitted(self) -> tuple[Array, Array]:
        """The unknowns and half their intervals, (_UNKNOWNS,) each."""
        rows = np.concatenate(self._stretches)
        edges = np.cumsum([0, *(len(stretch) for stretch in self._stretches)])
        parts = [slice(*edge) for edge in pairwise(edges.tolist())]
        value, left = np.zeros(_UNKNOWNS), rows[:, _SHOWN]
        for _ in range(_ROUNDS):
            terms, wanted = _equations(rows, value)
            normal = np.array([terms[part].T @ terms[part] for part in parts])
            shown = np.array([terms[part].T @ wanted[part] for part in parts])
            prior = np.diag(float(np.mean(left**2)) / self._priors**2)
            value = np.linalg.solve(normal.sum(axis=0) + prior, shown.sum(axis=0))
            left = wanted - terms @ value
        # Of all stretches but one, each.
        others = np.linalg.solve(
            normal.sum(axis=0) - normal + prior, (shown.sum(axis=0) - shown)[:, :, None]
        )[:, :, 0]
        return value, jackknife_half(others)


def _rows(tick: Tick, last: Tick, friction: Array) -> Array:
    """What the motors show that turn evenly and neither set off nor slow down, (k, 8).

    `friction`: current that it usually takes [A], (3,).
    """
    motors = tick.motors
    rows = np.zeros((WHEELS, 8))
    rows[:, _WHEEL] = np.arange(WHEELS)
    if motors.reports_currents:
        rows[:, _GAIN] = 1.0 / motors.constant
        rows[:, _SHOWN] = tick.current - tick.expected_current
    else:
        rows[:, _LOSS] = motors.resistance * tick.expected_current**2
        rows[:, _GAIN] = (
            tick.speed + 2.0 * motors.resistance * tick.expected_current / motors.constant
        )
        rows[:, _SQUARE] = motors.resistance / motors.constant**2
        rows[:, _SHOWN] = tick.power - tick.from_encoders
    rows[:, _SIGN] = np.sign(tick.speed)
    # Of the torques that reach the floor, those that move the robot and those that turn it.
    pushing = motors.radius * motors.forces(tick.expected_current, tick.speed, tick.change)
    parts = motors.to_twist.T * (motors.to_force @ pushing)
    rows[:, _CARRIED], rows[:, _TURNED] = parts[:, :2].sum(axis=1), parts[:, 2]
    # Of two currents that make the same power a wheel that slows down may have either.
    slows = np.sign(tick.speed) * tick.change < -_SLOWS
    # Of one that sets off a payload and hot windings look alike.
    sets_off = motors.constant * np.abs(tick.speed) < 2.0 * motors.resistance * np.abs(
        tick.expected_current
    )
    # What encoders show of a jerk is late and smooth.
    current = tick.expected_current
    jerks = np.abs(current - last.expected_current) > _EVEN * (np.abs(current) + friction)
    return rows[(np.abs(tick.speed) > MOVES) & ~slows & ~sets_off & ~jerks]


def _equations(rows: Array, value: Array) -> tuple[Array, Array]:
    """Of rows, with tau's square as the last value has it: (k, _UNKNOWNS) and (k,)."""
    wheel = rows[:, _WHEEL].astype(int)
    at_wheel = np.eye(WHEELS)[wheel]
    torque = (
        rows[:, _SIGN] * value[_FRICTION + wheel]
        + rows[:, _CARRIED] * value[_PAYLOAD]
        + rows[:, _TURNED] * value[_INERTIA]
    )
    is_power = rows[:, _SQUARE] > 0.0
    terms = np.column_stack(
        (
            rows[:, _LOSS],
            rows[:, _GAIN] * rows[:, _CARRIED],
            rows[:, _GAIN] * rows[:, _TURNED],
            (rows[:, _GAIN] * rows[:, _SIGN])[:, None] * at_wheel,
            is_power[:, None] * at_wheel,
        )
    )
    shown = rows[:, _SHOWN] - rows[:, _SQUARE] * torque**2
    return terms, shown


def _change(
    quantity: str, unit: str, value: float, half: float, worth: float
) -> Iterator[Severity]:
    """Nothing where it is not worth reporting, or not sure."""
    if abs(value) > max(_SURE * half, worth):
        yield Severity(quantity, unit, float(value), float(value - half), float(value + half))
