"""The robot as it is described, driven by the commands beside what the encoders show.

What a push leaves in a driver is taken over by the simulation, so a tick cannot be simulated before
the one before it was compared: as `CommandPath` and `RestingDrivers` do message by message.
"""

from itertools import pairwise

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled
from tomr_power_model.dynamics.simulation import Simulation, Steps, Variant
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.encoders import LONG_S
from tomr_power_model.model.resting import RestingDrivers
from tomr_power_model.robot import WHEELS
from tomr_training.drives import Drive
from tomr_training.planar.fits import Fits
from tomr_training.planar.plant import Motion, at_times, from_rest
from tomr_training.planar.schedule import TICK, commanded, tick_count
from tomr_training.planar.sensors import Signals

Array = NDArray[np.float64]


@frozen
class Expected:
    """What is expected of a drive."""

    motion: Motion
    # Of each tick, (ticks, 3): speeds and accelerations in its middle as `EncoderWindow.beside`
    # gives them, measured and simulated [rad/s, rad/s^2], voltages of the drivers as the power
    # sensors see them, of the simulated ones, and by their law alone [V].
    speed: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    simulated_speed: Array = field(repr=False)
    simulated_acceleration: Array = field(repr=False)
    held: Array = field(repr=False)
    simulated_held: Array = field(repr=False)
    by_law: Array = field(repr=False)


class _Path:
    """A simulation in progress, as `RestingDrivers` looks at it."""

    def __init__(self, simulation: Simulation) -> None:
        self.state = simulation.start()
        self._simulation = simulation
        self._scratch = simulation.inputs()
        self._nothing = np.zeros((0, WHEELS))

    def wheel(self, part: int) -> list[float]:
        """A field of the wheels' state."""
        return self._simulation.of_wheels(self.state, part)

    def add_to_sum(self, wheel: int, angle: float) -> None:
        """Add to what a wheel's driver has summed up of its errors [rad]."""
        self._simulation.add_to_sum(self.state, wheel, angle)

    def run(self, inputs: Array, out: Array) -> None:
        """Drive through some periods."""
        numbers, scratch = self._simulation.numbers, self._scratch
        compiled().run(numbers, self.state, inputs, self._nothing, 0, out, scratch, WHEELS)


def run_believed(drive: Drive, signals: Signals, share: Array) -> Expected:
    """Drive the robot as it is described, with the commands and nothing else.

    `share`: of each tick that has passed in the middle of what its power samples average, (ticks,).
    """
    robot, ticks = drive.believed, tick_count(drive)
    inputs = commanded(drive, robot)
    simulation = Simulation(vehicle_of(robot), is_compiled=True)
    path, drivers = _Path(simulation), RestingDrivers(robot, TICK)
    steps = simulation.steps
    step = simulation.period_s / steps
    out = np.empty((len(inputs), steps * simulation.row))
    ends = np.zeros((len(inputs) * steps + 1, WHEELS))
    shown = np.empty((7, ticks, WHEELS))  # as in `Expected`
    fits = Fits.over(signals.encoder_time, ticks, LONG_S)
    borders = np.round(TICK * np.arange(ticks + 1) / simulation.period_s).astype(np.int64)
    borders[-1] = len(inputs)
    before = np.array(path.wheel(at.SPEED))
    for k, (first, last) in enumerate(pairwise(borders)):
        path.run(inputs[first:last], out[first:last])
        means = Steps.of(out[first:last], WHEELS).speed
        ends[first * steps + 1 : last * steps + 1] = ends[first * steps] + step * np.cumsum(
            means, axis=0
        )
        after = np.array(path.wheel(at.SPEED))
        until = ends[: last * steps + 1]
        edges = at_times(until, step, TICK * np.array([k, k + 1.0]))
        mean, change = (edges[1] - edges[0]) / TICK, (after - before) / TICK
        angle, speed, acceleration = _seen(fits, k, until, step, (mean, change), signals)
        seen = angle.tolist(), speed.tolist()
        volts = drivers.voltages(path, *seen, simulated=mean.tolist(), share=float(share[k]))
        drives = volts.held, volts.simulated, volts.by_law
        shown[:, k] = speed, acceleration, mean, change, *drives
        before = after
    variant = Variant(np.asarray(simulation.numbers))
    motion = Motion(variant, from_rest(inputs), Steps.of(out, WHEELS), step, ticks)
    return Expected(motion, *shown)


def _seen(
    fits: Fits,
    tick: int,
    ends: Array,
    step: float,
    simulated: tuple[Array, Array],
    signals: Signals,
) -> tuple[Array, Array, Array]:
    """Angle at the end of a tick, and speed and acceleration in its middle, (3,) each.

    As `EncoderWindow.beside` gives them beside a simulated motion of some mean speed and
    acceleration.
    """
    middle = at_times(ends, step, TICK * np.array([tick + 0.5]))[0]
    index = fits.index[tick]
    ahead = signals.position[index] - at_times(ends, step, signals.encoder_time[index])
    offset, slope, curve = fits.of(tick, ahead)
    speed, acceleration = simulated[0] + slope, simulated[1] + curve
    half = 0.5 * TICK
    return middle + offset + half * (speed + 0.5 * half * acceleration), speed, acceleration
