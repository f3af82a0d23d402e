"""What the channels of a recording would show, had the robot been another one.

The commands of the recording drive the closed loop of each robot from the start to the end in one
go. The angles of its wheels and its heading are taken as measured: the simulated ones are soon a
tooth off, and what depends on them would be in the wrong place.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.drive.motion import turned_angle
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics import batch
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, no_input, timing_of, wheel_records
from tomr_power_model.dynamics.simulation import Excitation, Readout, Variant, drive, predict
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.alignment.channels import MOTOR_KINDS, Channel, Kind

Array = NDArray[np.float64]
Tick = Callable[[int], None]

_LEAD = 1.0  # s before the first encoder sample: earlier commands have begun to act by then
_KINDS: dict[Kind, int] = {
    "speed": batch.SPEED,
    "power": batch.POWER,
    "total": batch.TOTAL,
    "voltage": batch.SUPPLY_VOLTAGE,
    "yaw": batch.YAW,
    "current": batch.CURRENT,
}


@frozen
class Timeline:
    """Driver periods of a recording and its lead; period k ends at start + (k + 1) period."""

    start: float  # of the first period [s]
    period: float  # s
    count: int

    @property
    def begins(self) -> Array:
        """Starts of the periods [s], (count,)."""
        return np.asarray(self.start + self.period * np.arange(self.count))

    @property
    def middle(self) -> Array:
        """Middles of the periods [s], (count,)."""
        return np.asarray(self.begins + 0.5 * self.period)

    @property
    def phase(self) -> float:
        """How long before the first encoder sample a period begins [s]."""
        return -self.start % self.period

    @classmethod
    def of(cls, recorded: Drive, robot: Robot) -> "Timeline":
        """From the lead to the last measurement; commands come as a period begins, on the whole."""
        period = timing_of(robot.controller.rate).period
        phase = _phase(recorded.command_time + robot.controller.delay, period)
        start = phase - period * math.ceil(_LEAD / period)
        last = max(float(time[-1]) for time in _times(recorded))
        return cls(start, period, math.ceil((last - start) / period) + 2)


@frozen
class Run:
    """Means over driver periods of a simulated drive."""

    speed: Array  # of the wheels [rad/s], (k, n)
    power: Array  # drawn by each driver [W], (k, n)
    copper: Array  # i^2 R [W], (k, n)
    current: Array  # of each motor [A], (k, n)
    voltage: Array  # of the supply [V], (k,)
    yaw_rate: Array  # rad/s, (k,)


@frozen
class RecordingSimulation:
    """Simulates the channels of one recording; `robot` is what the drivers believe."""

    recorded: Drive
    robot: Robot
    channels: tuple[Channel, ...]
    timeline: Timeline
    resisting: Array | None = None  # torques that no description holds [N m], (count, n)
    drawn: Array | None = None  # power that no description holds, of all channels' values, (rows,)

    @classmethod
    def of(
        cls, recorded: Drive, robot: Robot, channels: tuple[Channel, ...]
    ) -> "RecordingSimulation":
        """Prepare a recording."""
        line = Timeline.of(recorded, robot)
        end = line.start + line.period * line.count
        inside = tuple(_inside(channel, -line.phase, end) for channel in channels)
        return cls(recorded, robot, tuple(c for c in inside if len(c.time)), line)

    @property
    def size(self) -> int:
        """Number of values of all channels."""
        return sum(len(channel.time) for channel in self.channels)

    @cached_property
    def excitation(self) -> Excitation:
        """Commands, wheel angles and heading of each driver period."""
        line, recorded = self.timeline, self.recorded
        inputs = np.tile(no_input(WHEELS), (line.count, 1))
        held = _held(recorded, line.begins + 0.5 * line.period, self.robot.controller.delay)
        inputs[:, at.COMMAND : at.COMMAND + 3] = held
        turned = np.stack([turned_angle(recorded, wheel) for wheel in range(WHEELS)], axis=1)
        angle = np.stack(
            [np.interp(line.begins, recorded.encoder_time, column) for column in turned.T], axis=1
        )
        wheels = inputs[:, at.INPUT_HEADER :].reshape(line.count, WHEELS, at.INPUT_WHEEL)
        wheels[..., at.SEEN_ANGLE] = angle
        heading = (angle - angle[0]) @ wheels_to_twist(self.robot)[2]
        inputs[:, at.SEEN_HEADING] = heading
        # What came before the lead has long been driven.
        return Excitation(line.start, inputs, held[0], np.zeros(3), 0.0, angle[0])

    @cached_property
    def readout(self) -> Readout:
        """What the channels show, and when."""
        rows, first = [], 0
        for channel in self.channels:
            last = first + len(channel.time)
            rows.append((_KINDS[channel.kind], channel.wheel or 0, first, last))
            first = last
        return Readout(
            np.array(rows, dtype=np.int64).reshape(-1, 4),
            np.concatenate([np.empty(0), *(channel.time for channel in self.channels)]),
            np.concatenate([np.empty(0), *(channel.span for channel in self.channels)]),
        )

    def predict(self, robots: Sequence[Robot], later: Sequence[float] = ()) -> Array:
        """Values of all channels one after another, for each robot, (v + l, n).

        The last l rows are those of the first robot, did it respond later by so much [s].
        """
        return predict_all((self,), robots, later=later)

    def predicted(
        self, robots: Sequence[Robot], tick: Tick, later: Sequence[float]
    ) -> Iterator[Array]:
        """The rows of `predict` one by one."""
        variants = [
            self._variant(robot, later if row < 1 else ()) for row, robot in enumerate(robots)
        ]
        return self._shown(variants, tick)

    def respond(self, robot: Robot, torques: Array) -> Iterator[Array]:
        """Values of all channels where torques resist besides, row by row, (n,) each.

        Args:
            robot: one robot.
            torques: of each wheel in each driver period [N m], (v, count, n).
        """
        one = self._variant(robot)
        if self.resisting is not None:
            torques = torques + self.resisting
        return self._shown([evolve(one, resisting=torque) for torque in torques])

    def changes(self, robot: Robot, torques: Array) -> NDArray[np.float32]:
        """What such torques change in the values, (v, n)."""
        found = np.empty((len(torques), self.size), dtype=np.float32)
        plain = self.predict([robot])[0]
        for row, value in enumerate(self.respond(robot, torques)):
            found[row] = value - plain
        return found

    def run(self, robot: Robot) -> Run:
        """What happens to a robot in the drive."""
        steps, line = drive(self._variant(robot), self.excitation, WHEELS), self.timeline

        def means(rows: Array) -> Array:
            return np.asarray(rows.reshape(line.count, -1, *rows.shape[1:]).mean(axis=1))

        return Run(
            means(steps.speed),
            means(steps.power),
            means(steps.copper),
            means(steps.current),
            means(steps.voltage),
            means(steps.yaw_rate),
        )

    def _shown(
        self, variants: Sequence[Variant], tick: Tick = lambda done: None
    ) -> Iterator[Array]:
        """First values of each variant, then those of the first when it is later."""
        rest: list[Array] = []
        for found in predict(variants, self.excitation, self.readout, WHEELS, tick):
            if self.drawn is not None:
                found += self.drawn
            # A sensor averages before it forgets the sign.
            np.abs(found, out=found, where=self._unsigned)
            rest.extend(found[1:])
            yield found[0]
        yield from rest

    @cached_property
    def _unsigned(self) -> NDArray[np.bool_]:
        """Values of sensors that see no sign, (rows,)."""
        kinds = () if self.robot.measurement.signed else MOTOR_KINDS
        sizes = [len(channel.time) for channel in self.channels]
        unsigned = np.array([channel.kind in kinds for channel in self.channels], dtype=bool)
        return np.repeat(unsigned, sizes)

    def _variant(self, robot: Robot, later: Sequence[float] = ()) -> Variant:
        """A robot whose drivers go on believing that it is as described.

        Commands are held for whole driver periods; by the rest of its delay all is read earlier.
        """
        numbers = laid_out(vehicle_of(robot))
        wheel_records(numbers)[:, at.ASK : at.ASK + 3] = self._asked
        numbers[at.YAW_STEP] = numbers[at.LINEAR_STEP] / self.robot.robot_radius
        delay = robot.controller.delay - self.robot.controller.delay
        late = round(delay / self.timeline.period)
        rest = delay - late * self.timeline.period
        return Variant(numbers, late, (rest, *(rest + item for item in later)), self.resisting)

    @cached_property
    def _asked(self) -> Array:
        """Wheel speeds per twist as the drivers believe, (n, 3)."""
        return wheel_records(laid_out(vehicle_of(self.robot)))[:, at.ASK : at.ASK + 3]


def predict_all(
    simulations: Sequence[RecordingSimulation],
    robots: Sequence[Robot],
    tick: Tick = lambda done: None,
    later: Sequence[float] = (),
) -> Array:
    """As `RecordingSimulation.predict`, of recordings one after another, (v + l, n)."""
    found = np.empty((len(robots) + len(later), sum(item.size for item in simulations)))
    return filled(found, [item.predicted(robots, tick, later) for item in simulations])


def filled(found: Array, parts: Iterable[Iterator[Array]]) -> Array:
    """An array filled with the rows of recordings, one recording beside the other."""
    first = 0
    for part in parts:
        last = first
        for row, values in enumerate(part):
            last = first + len(values)
            found[row, first:last] = values
        first = last
    return found


def _times(recorded: Drive) -> list[Array]:
    found = [recorded.encoder_time, recorded.power_time, recorded.total_time, recorded.imu_time]
    return [time for time in found if len(time)]


def _held(recorded: Drive, time: Array, delay: float) -> Array:
    """Command in force at each time, (m, 3); nothing is asked for before the first."""
    latest = np.searchsorted(recorded.command_time + delay, time, side="right")
    return np.concatenate([np.zeros((1, 3)), recorded.command])[latest]


def _phase(times: Array, period: float) -> float:
    """Where in a driver's period commands come, on the whole [s], in (-period, 0]."""
    if not len(times):
        return 0.0
    turn = np.exp(2j * np.pi * times / period).sum()
    return float(np.angle(turn) / (2.0 * np.pi) % 1.0 - 1.0) * period


def _inside(channel: Channel, start: float, end: float) -> Channel:
    """Without what was measured before the encoders began or after all else had ended."""
    return channel.at((channel.time - channel.span >= start) & (channel.time <= end))
