"""Simulations: one vehicle period by period, or many variants over a whole drive at once."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import local
from typing import Any

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled, plain
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.vehicle import Vehicle

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
State = Any  # a list of floats, or an array where it is compiled

_REST: Triple = (0.0, 0.0, 0.0)


class Simulation:
    """One vehicle, period by period.

    In plain Python it starts at once and needs no compiler; compiled it gives the same numbers a
    hundred times as fast. The state goes in and is changed in place; `layout` says where each
    number stands.
    """

    def __init__(self, vehicle: Vehicle, *, is_compiled: bool = False) -> None:
        self.wheels = vehicle.count
        self._made: Callable[[list[float]], State] = np.array if is_compiled else list
        self.numbers = self._made(laid_out(vehicle).tolist())
        self.steps = int(self.numbers[at.SUBSTEPS])
        self.period_s = float(self.numbers[at.PERIOD])
        self.row = at.output_size(self.wheels)
        self._step = compiled() if is_compiled else plain(tuple(vehicle.physics))

    def start(
        self,
        twist: Triple = _REST,
        rate: Triple = _REST,
        heading: float = 0.0,
        angle: float = 0.0,
    ) -> State:
        """A state that drives on steadily.

        Args:
            twist: of the body [m/s, m/s, rad/s].
            rate: its change [m/s^2, m/s^2, rad/s^2].
            heading: rad.
            angle: of all wheels [rad]; NaN: not known.
        """
        state = [0.0] * at.state_size(self.wheels)
        state[at.TWIST : at.TWIST + 3], state[at.RATE : at.RATE + 3] = twist, rate
        state[at.HEADING] = heading
        state[at.STATE_HEADER + at.ANGLE :: at.STATE_WHEEL] = [angle] * self.wheels
        state = self._made(state)
        motion = self._made([0.0] * (at.MOTION_HEADER + self.wheels * at.MOTION_WHEEL))
        power = self._made([0.0] * (self.wheels * at.POWER_WHEEL))
        self._step.begin(self.numbers, state, motion, power, self.wheels)
        return state

    def inputs(self) -> State:
        """Inputs of a period in which nothing is asked for, to be changed."""
        return self._made(list(no_input(self.wheels)))

    def advance(self, state: State, inputs: State) -> list[float]:
        """One driver period; returns the outputs of its steps, one after another."""
        out = self._made([0.0] * (self.steps * self.row))
        self._step.advance(self.numbers, state, inputs, out, self.wheels)
        return as_list(out)

    def of_wheels(self, state: State, field: int) -> list[float]:
        """A field of all wheels."""
        return as_list(state[at.STATE_HEADER + field :: at.STATE_WHEEL])

    def add_to_sum(self, state: State, wheel: int, angle: float) -> None:
        """Add to what a wheel's driver has summed up of its errors [rad]."""
        state[at.STATE_HEADER + wheel * at.STATE_WHEEL + at.INTEGRAL] += angle


def as_list(values: State) -> list[float]:
    """Numbers of a state or of outputs as a list."""
    found: list[float] = values if isinstance(values, list) else values.tolist()
    return found


@frozen
class Excitation:
    """What drives a simulation through a recording: k driver periods, and how it begins."""

    start: float  # of the first period [s]
    inputs: Array  # of each period, (k, input_size)
    twist: Array  # at the start [m/s, m/s, rad/s], (3,)
    rate: Array  # its change, (3,)
    heading: float  # rad
    angle: Array  # of the wheels, as joint_states count them [rad], (n,)


@frozen
class Readout:
    """What sensors show, and when."""

    channels: NDArray[np.int64]  # kind of `batch`, wheel, first and last row of each, (c, 4)
    time: Array  # ends of what the values are means of [s], (rows,)
    span: Array  # how long that is [s], 0 for an instant, (rows,)


@frozen
class Variant:
    """One robot to be simulated, and what is special about it."""

    numbers: Array = field(repr=False)  # of `laid_out`
    late: int = 0  # driver periods by which its commands come later
    later: tuple[float, ...] = (0.0,)  # it is read for each of these delays of everything [s]
    resisting: Array | None = None  # torques that resist besides [N m], (k, n)


@frozen
class Steps:
    """What came out of a drive, means over its m steps."""

    rows: Array = field(repr=False)  # as `layout` has them, (m, output_size)
    voltage: Array  # of the supply [V], (m,)
    yaw_rate: Array  # rad/s, (m,)
    speed: Array  # of the wheels [rad/s], (m, n)
    power: Array  # drawn by each driver [W], (m, n)
    tilt: Array  # change of that power from a step's start to its end [W], (m, n)
    current: Array  # of each motor [A], (m, n)
    copper: Array  # i^2 R [W], (m, n)
    torque: Array  # of each motor at the wheel [N m], (m, n)
    gap: Array  # sliding of the contacts in the rolling direction [m/s], (m, n)
    asked: Array  # wheel speeds that the drivers are asked for [rad/s], (m, n)
    sums: Array  # of the drivers' errors [rad], (m, n)
    shown: Array  # speeds as the encoders show them [rad/s], (m, n)

    @classmethod
    def of(cls, out: Array, wheels: int) -> "Steps":
        """From the outputs of all periods."""
        rows = out.reshape(-1, at.output_size(wheels))
        own = rows[:, at.OUT_HEADER :].reshape(len(rows), wheels, at.OUT_WHEEL)
        return cls(
            rows=rows,
            voltage=rows[:, at.OUT_VOLTAGE],
            yaw_rate=rows[:, at.OUT_YAW],
            speed=own[..., at.OUT_SPEED],
            power=own[..., at.OUT_POWER],
            tilt=own[..., at.OUT_TILT],
            current=own[..., at.OUT_CURRENT],
            copper=own[..., at.OUT_COPPER],
            torque=own[..., at.OUT_TORQUE],
            gap=own[..., at.OUT_GAP],
            asked=own[..., at.OUT_ASKED],
            sums=own[..., at.OUT_SUM],
            shown=own[..., at.OUT_SHOWN],
        )


class _Buffers(local):
    """Scratch of one thread."""

    def __init__(self) -> None:
        self.out = np.empty((0, 0))
        self.work = np.empty((3, 0))

    def sized(self, periods: int, width: int, steps: int) -> tuple[Array, Array]:
        if self.out.shape != (periods, width):
            self.out = np.empty((periods, width))
            self.work = np.empty((3, periods * steps + 1))
        return self.out, self.work


@frozen
class _Job:
    excitation: Excitation
    wheels: int

    def state(self) -> Array:
        n, given = self.wheels, self.excitation
        state = np.zeros(at.state_size(n))
        state[at.TWIST : at.TWIST + 3] = given.twist
        state[at.RATE : at.RATE + 3] = given.rate
        state[at.HEADING] = given.heading
        wheels = state[at.STATE_HEADER :].reshape(n, at.STATE_WHEEL)
        wheels[:, at.ANGLE] = given.angle
        return state

    def scratch(self) -> Array:
        n = self.wheels
        most = max(at.input_size(n), at.MOTION_HEADER + n * at.MOTION_WHEEL, n * at.POWER_WHEEL)
        return np.zeros((3, most))

    def resisting(self, variant: Variant) -> Array:
        return np.zeros((0, self.wheels)) if variant.resisting is None else variant.resisting


def predict(
    variants: Sequence[Variant],
    excitation: Excitation,
    readout: Readout,
    wheels: int = 3,
    tick: Callable[[int], None] = lambda done: None,
) -> Iterator[Array]:
    """Values that the sensors show of each variant, (delays of its `later`, rows) each.

    Variants run side by side on as many cores as `worker_count` says.
    """
    buffers = _Buffers()
    dynamics: Any = compiled()
    job = _Job(excitation, wheels)

    def one(variant: Variant) -> Array:
        periods, steps = len(excitation.inputs), int(variant.numbers[at.SUBSTEPS])
        out, work = buffers.sized(periods, steps * at.output_size(wheels), steps)
        found = np.empty((len(variant.later), len(readout.time)))
        dynamics.predict(
            variant.numbers,
            job.state(),
            excitation.inputs,
            job.resisting(variant),
            variant.late,
            excitation.start,
            np.array(variant.later),
            readout.channels,
            readout.time,
            readout.span,
            found,
            out,
            work,
            job.scratch(),
            wheels,
        )
        return found

    return _mapped(one, variants, tick)


def worker_count() -> int:
    """Threads that simulate side by side: OMP_NUM_THREADS, as for linear algebra, or all cores.

    Who runs several processes, such as Dask, sets it to 1.
    """
    given = os.environ.get("OMP_NUM_THREADS", "")
    return max(1, int(given)) if given.isdecimal() else len(os.sched_getaffinity(0))


def drive(
    variant: Variant,
    excitation: Excitation,
    wheels: int = 3,
    changes: Sequence[tuple[int, Array]] = (),
) -> Steps:
    """All that happens to one variant in a drive.

    `changes`: periods, rising, from which on other numbers of the robot hold, of the same drivers.
    """
    job, dynamics = _Job(excitation, wheels), compiled()
    steps = int(variant.numbers[at.SUBSTEPS])
    out = np.empty((len(excitation.inputs), steps * at.output_size(wheels)))
    state, scratch, extra = job.state(), job.scratch(), job.resisting(variant)
    dynamics.begin(variant.numbers, state, scratch[1], scratch[2], wheels)
    starts = [0, *(start for start, _ in changes), len(out)]
    parts = (variant.numbers, *(numbers for _, numbers in changes))
    for numbers, start, end in zip(parts, starts, starts[1:], strict=False):
        inputs, own = excitation.inputs[start:end], extra[start:end]
        dynamics.run(numbers, state, inputs, own, variant.late, out[start:end], scratch[0], wheels)
    return Steps.of(out, wheels)


def shown(
    variant: Variant, excitation: Excitation, steps: Steps, readout: Readout, wheels: int = 3
) -> Array:
    """Values that the sensors show of a drive, (rows,); without the variant's `later`."""
    found = np.empty(len(readout.time))
    work = np.empty((3, len(steps.rows) + 1))
    given, start = variant.numbers, excitation.start
    rows, time, span = readout.channels, readout.time, readout.span
    compiled().read(given, steps.rows, start, 0.0, rows, time, span, found, work, wheels)
    return found


def _mapped(
    one: Callable[[Variant], Array], variants: Sequence[Variant], tick: Callable[[int], None]
) -> Iterator[Array]:
    """Each variant's result, in order; compiled code sets the interpreter free meanwhile."""
    workers = min(worker_count(), len(variants))
    if workers < 2:
        for variant in variants:
            yield one(variant)
            tick(1)
        return
    with ThreadPoolExecutor(workers) as pool:
        for found in pool.map(one, variants):
            yield found
            tick(1)
