"""What the commands lead to: the drivers' closed loop, simulated tick by tick.

The loop's periods are where commands come: a command acts from the period on that begins nearest to
it, and the periods' phase follows the commands' stamps. A period belongs to the tick in which its
middle lies, so that an answer rests on messages up to its tick alone.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation, State
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot
from tomr_power_model.unmodelled.online import NOTHING, OnlineTerms

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_STOP: Triple = (0.0, 0.0, 0.0)
_REMEMBERED = 400_000_000  # ns, of simulated motion
_STEADY = 50  # commands over which the phase of the periods is averaged


@frozen
class CommandTiming:
    """When commands count, all in nanoseconds."""

    period: int  # of the ticks
    timeout: int = 0  # a command this old counts as a stop; 0: it is held
    patience: int = to_ns(0.5)  # for encoders to say how the first command finds the robot


@frozen
class Seen:
    """What was measured at the start of a tick, NaN where it is not known."""

    twist: Triple  # of the body [m/s, m/s, rad/s]
    angle: Sequence[float]  # of the wheels, as joint_states count them [rad]
    heading: float  # against the start [rad]


@frozen
class Commanded:
    """The steps that belong to a tick; at least one, but for drivers slower than the ticks."""

    speed: list[float]  # of the wheels as encoders show it, mean of the tick [rad/s]
    torque: list[float]  # of the motors at the wheels, likewise [N m]
    voltage: float  # of the supply, likewise [V]
    starts: tuple[int, ...]  # of each step [ns]
    length: int  # of a step [ns]
    rows: tuple[list[float], ...]  # outputs of each step, see `layout`
    edge: tuple[float, ...]  # wheel speeds before the first of them [rad/s]

    def wheels(self, row: Sequence[float], field: int) -> Sequence[float]:
        """A field of the wheels' outputs."""
        return row[at.OUT_HEADER + field :: at.OUT_WHEEL]


class SimulatedMotion:
    """Angles and speeds that encoders show at the steps' ends, of the last moments."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, ...]] = deque()  # time since the origin [ns], rad, rad/s
        self._origin = 0

    def add(self, time_ns: int, angles: list[float], speeds: list[float]) -> None:
        """Take the end of a step: wheels [rad] and [rad/s]."""
        points = self._points
        if not points:
            self._origin = time_ns
        points.append((float(time_ns - self._origin), *angles, *speeds))
        while points[0][0] < points[-1][0] - _REMEMBERED:
            points.popleft()

    def beside(
        self, times_ns: Sequence[int], tick_ns: int, period_ns: int
    ) -> tuple[Array, Array, Array, Array]:
        """Angles at some times [rad], (k, n), and at the middle of the window that ends at a tick;
        mean speed and acceleration in that window, (n,) each. Beyond the ends as the nearest step
        has it.
        """
        rows = np.array(self._points)
        time, wheels = rows[:, 0], rows.shape[1] // 2
        window = (tick_ns - period_ns, tick_ns - period_ns // 2, tick_ns)
        wanted = np.array([*times_ns, *window], dtype=np.float64) - self._origin
        place = np.clip(np.searchsorted(time, wanted) - 1, 0, max(len(time) - 2, 0))
        after = np.minimum(place + 1, len(time) - 1)
        length = np.maximum(time[after] - time[place], 1.0)
        share = ((wanted - time[place]) / length)[:, None]
        found = rows[place, 1:] + share * (rows[after, 1:] - rows[place, 1:])
        first, middle, last = found[-3:]
        rate = 1e9 / period_ns
        speed, change = rate * (last - first)[:wheels], rate * (last - first)[wheels:]
        return found[:-3, :wheels], middle[:wheels], speed, change


class CommandPath:
    """Runs the closed loop over the commands, each held until the next."""

    def __init__(self, robot: Robot, timing: CommandTiming, *, is_compiled: bool = False) -> None:
        self._simulation = Simulation(vehicle_of(robot), is_compiled=is_compiled)
        self._terms = (
            OnlineTerms(robot.unmodelled, wheels_to_twist(robot), 1e-9 * timing.period)
            if robot.unmodelled
            else None
        )
        self._step = to_ns(self._simulation.period_s)
        self._part = self._step // self._simulation.steps
        self._timing = timing
        self._delay = to_ns(robot.controller.delay)
        self._pending: deque[tuple[int, Triple]] = deque()
        self.clear()

    def clear(self) -> None:
        """Forget all commands: what the robot does is not known until the next."""
        self._pending.clear()
        self.state: State | None = None
        self._inputs = self._simulation.inputs()
        self._given = 0
        self._next = 0  # when the next period begins [ns]
        self._taken = 0  # commands
        self.motion = SimulatedMotion()
        self.besides = NOTHING  # what learnt terms do in the last tick
        self._flowing: Sequence[float] = (0.0, 0.0, 0.0)  # currents of its last step [A]
        if self._terms is not None:
            self._terms.clear()
        resting = [0.0] * self._simulation.wheels
        self._means = resting, resting, float(self._simulation.numbers[at.VOLTAGE])

    def command(self, stamp_ns: int, twist: Triple) -> None:
        """Take a command; one that comes too late for its stamp acts from the next period on."""
        self._pending.append((stamp_ns + self._delay, twist))

    def wheel(self, field: int) -> list[float]:
        """A field of the wheels' state, see `layout`; empty before the first command."""
        if self.state is None:
            return []
        return self._simulation.of_wheels(self.state, field)

    def add_to_sum(self, wheel: int, angle: float) -> None:
        """Add to what a wheel's driver has summed up of its errors [rad]."""
        assert self.state is not None
        self._simulation.add_to_sum(self.state, wheel, angle)

    def over(self, tick_ns: int, seen: Seen) -> Commanded | None:
        """Means over the window that ends at a tick, or None without a command.

        The simulation starts with the motion that the first command finds, where encoders measure
        it within a while, else at rest.
        """
        if self.state is None and not self._started(tick_ns, seen):
            return None
        assert self.state is not None
        self._see(seen)
        self._resist(seen)
        edge = tuple(self.wheel(at.SPEED))
        starts: list[int] = []
        rows: list[list[float]] = []
        width = self._simulation.row
        while self._next + self._step // 2 <= tick_ns:
            self._take()
            out = self._simulation.advance(self.state, self._inputs)
            for k in range(self._simulation.steps):
                starts.append(self._next + k * self._part)
                rows.append(self._with_drawn(out[k * width : (k + 1) * width]))
            self._see(None)
            self._next += self._step
            self.motion.add(self._next, *self._standing())
        if rows:
            self._means = self._mean_of(rows)
        speed, torque, voltage = self._means
        return Commanded(speed, torque, voltage, tuple(starts), self._part, tuple(rows), edge)

    def _started(self, tick_ns: int, seen: Seen) -> bool:
        if not self._pending or self._pending[0][0] > tick_ns:
            return False
        known = seen.twist[0] == seen.twist[0]
        first = self._pending[0][0]
        if not known and tick_ns - first < self._timing.patience:
            return False
        self.state = self._simulation.start(seen.twist if known else _STOP, angle=math.nan)
        self._inputs[at.COMMAND : at.COMMAND + 3] = self.state[at.SET : at.SET + 3]
        self.motion.add(tick_ns - self._timing.period, *self._standing())
        # The first period of this tick, in step with the command.
        begin = tick_ns - self._timing.period
        self._next = first + -(-(begin - first - self._step // 2) // self._step) * self._step
        return True

    def _resist(self, seen: Seen) -> None:
        """Learnt terms resist in all periods of the tick as the motion at its start asks."""
        if self._terms is None:
            return
        angle, heading = self.wheel(at.ANGLE), seen.heading
        self.besides = self._terms.over(self.wheel(at.SPEED), self._flowing, angle, heading)
        for wheel, torque in enumerate(self.besides.torque):
            place = at.INPUT_HEADER + wheel * at.INPUT_WHEEL + at.RESISTING
            self._inputs[place] = torque

    def _with_drawn(self, row: list[float]) -> list[float]:
        """A step's outputs with what learnt terms draw."""
        if self._terms is not None:
            self._flowing = row[at.OUT_HEADER + at.OUT_CURRENT :: at.OUT_WHEEL]
            for wheel, power in enumerate(self.besides.driver):
                row[at.OUT_HEADER + wheel * at.OUT_WHEEL + at.OUT_POWER] += power
        return row

    def _standing(self) -> tuple[list[float], list[float]]:
        return self.wheel(at.TURNED), self.wheel(at.SHOWN)

    def _see(self, seen: Seen | None) -> None:
        """Put the simulation where the robot was seen, for one period; None: as it goes on."""
        heading, angle = (None, None) if seen is None else (seen.heading, seen.angle)
        self._inputs[at.SEEN_HEADING] = math.nan if heading is None else heading
        for wheel in range(self._simulation.wheels):
            place = at.INPUT_HEADER + wheel * at.INPUT_WHEEL + at.SEEN_ANGLE
            self._inputs[place] = math.nan if angle is None else angle[wheel]

    def _take(self) -> None:
        """The command in force in the period that begins now."""
        while self._pending and self._pending[0][0] <= self._next + self._step // 2:
            self._given, twist = self._pending.popleft()
            self._inputs[at.COMMAND : at.COMMAND + 3] = twist
            self._taken = min(self._taken + 1, _STEADY)
            off = (self._given - self._next + self._step // 2) % self._step - self._step // 2
            self._next += off // self._taken
        if self._timing.timeout and self._next > self._given + self._timing.timeout:
            self._inputs[at.COMMAND : at.COMMAND + 3] = _STOP

    def _mean_of(self, rows: Sequence[Sequence[float]]) -> tuple[list[float], list[float], float]:
        """Mean wheel speeds and motor torques, and the supply's voltage."""
        first = at.OUT_HEADER
        means = [sum(column) / len(rows) for column in zip(*rows, strict=True)]
        return (
            means[first + at.OUT_SHOWN :: at.OUT_WHEEL],
            means[first + at.OUT_TORQUE :: at.OUT_WHEEL],
            means[at.OUT_VOLTAGE],
        )
