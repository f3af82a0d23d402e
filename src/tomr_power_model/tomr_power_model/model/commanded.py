"""What the commands lead to: the drivers' closed loop, simulated tick by tick.

The loop's periods are where commands come: a command acts from the period on that begins nearest to
it, and the periods' phase follows the commands' stamps. A period belongs to the tick in which its
middle lies, so that an answer rests on messages up to its tick alone.
"""

from collections import deque
from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation, State
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot

Triple = tuple[float, float, float]

_STOP: Triple = (0.0, 0.0, 0.0)
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
    """Means over the periods of a tick, one number per wheel."""

    speed: list[float]  # rad/s
    torque: list[float]  # of the motors at the wheels [N m]
    current: list[float]  # A
    at_motor: list[float]  # voltage * current [W]
    power: list[float]  # drawn [W]
    voltage: float  # of the supply [V]
    rows: tuple[tuple[float, ...], ...]  # wheel speeds in each step [rad/s]
    edge: tuple[float, ...]  # wheel speeds before the first of them [rad/s]


class CommandPath:
    """Runs the closed loop over the commands, each held until the next."""

    def __init__(self, robot: Robot, timing: CommandTiming) -> None:
        self._simulation = Simulation(vehicle_of(robot))
        self._constant = [motor.wheel_constant for motor in robot.motors]
        self._step = to_ns(self._simulation.period_s)
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
        self._held: Commanded | None = None

    @property
    def step_s(self) -> float:
        """Duration of a simulated step [s]."""
        return self._simulation.period_s / self._simulation.steps

    def command(self, stamp_ns: int, twist: Triple) -> None:
        """Take a command; one that comes too late for its stamp acts from the next period on."""
        self._pending.append((stamp_ns + self._delay, twist))

    def wheel(self, field: int) -> list[float]:
        """A field of the wheels' state, see `layout`; empty before the first command."""
        if self.state is None:
            return []
        first, last = at.STATE_HEADER + field, len(self.state)
        return self.state[first : last : at.STATE_WHEEL]

    def asked(self) -> list[float]:
        """Wheel speeds that the drivers are asked for now [rad/s]."""
        assert self.state is not None
        p, (x, y, yaw) = self._simulation.numbers, self.state[at.SET : at.SET + 3]
        records = range(at.HEADER, int(p[at.COUPLING]), int(p[at.STRIDE]))
        rows = [p[first + at.ASK : first + at.ASK + 3] for first in records]
        return [a * x + b * y + c * yaw for a, b, c in rows]

    def over(self, tick_ns: int, seen: Seen) -> Commanded | None:
        """Means over the window that ends at a tick, or None without a command.

        The simulation starts with the motion that the first command finds, where encoders tell it
        within a while, else at rest.
        """
        if self.state is None and not self._started(tick_ns, seen):
            return None
        assert self.state is not None
        self._see(seen)
        edge = tuple(self.wheel(at.SPEED))
        outputs: list[float] = []
        while self._next + self._step // 2 <= tick_ns:
            self._take()
            outputs += self._simulation.advance(self.state, self._inputs)
            self._see(None)
            self._next += self._step
        return self._means(outputs, edge)

    def _started(self, tick_ns: int, seen: Seen) -> bool:
        if not self._pending or self._pending[0][0] > tick_ns:
            return False
        known = seen.twist[0] == seen.twist[0]
        first = self._pending[0][0]
        if not known and tick_ns - first < self._timing.patience:
            return False
        self.state = self._simulation.start(seen.twist if known else _STOP)
        self._inputs[at.COMMAND : at.COMMAND + 3] = self.state[at.SET : at.SET + 3]
        # The first period of this tick, in step with the command.
        begin = tick_ns - self._timing.period
        self._next = first + -(-(begin - first - self._step // 2) // self._step) * self._step
        return True

    def _see(self, seen: Seen | None) -> None:
        """Put the simulation where the robot was seen, for one period; None: as it goes on."""
        heading, angle = (None, None) if seen is None else (seen.heading, seen.angle)
        self._inputs[at.SEEN_HEADING] = float("nan") if heading is None else heading
        for wheel in range(self._simulation.wheels):
            place = at.INPUT_HEADER + wheel * at.INPUT_WHEEL + at.SEEN_ANGLE
            self._inputs[place] = float("nan") if angle is None else angle[wheel]

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

    def _means(self, outputs: list[float], edge: tuple[float, ...]) -> Commanded | None:
        width = self._simulation.row
        count = len(outputs) // width
        if not count:  # a driver slower than the ticks
            return self._held

        def mean(first: int) -> float:
            return sum(outputs[first::width]) / count

        def of_wheels(field: int) -> list[float]:
            starts = range(at.OUT_HEADER + field, width, at.OUT_WHEEL)
            return [mean(start) for start in starts]

        at_motor = []
        for wheel, constant in enumerate(self._constant):
            own = at.OUT_HEADER + wheel * at.OUT_WHEEL
            speed = outputs[own + at.OUT_SPEED :: width]
            current = outputs[own + at.OUT_CURRENT :: width]
            emf = sum([w * i for w, i in zip(speed, current, strict=True)]) * constant / count
            at_motor.append(emf + mean(own + at.OUT_COPPER))
        rows = [
            tuple(outputs[row + at.OUT_HEADER + at.OUT_SPEED : row + width : at.OUT_WHEEL])
            for row in range(0, len(outputs), width)
        ]
        self._held = Commanded(
            speed=of_wheels(at.OUT_SPEED),
            torque=of_wheels(at.OUT_TORQUE),
            current=of_wheels(at.OUT_CURRENT),
            at_motor=at_motor,
            power=of_wheels(at.OUT_POWER),
            voltage=mean(at.OUT_VOLTAGE),
            rows=tuple(rows),
            edge=edge,
        )
        return self._held
