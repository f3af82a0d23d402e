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
from tomr_power_model.model.encoders import LONG_S, WheelEstimate
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
    # Of each tick, (ticks, 3): how encoders show wheels in its middle as `EncoderWindow.beside`
    # gives it, measured and simulated, voltages of the drivers as the power sensors see them, of
    # the simulated ones, and by their law alone [V].
    measured: WheelEstimate = field(repr=False)
    simulated: WheelEstimate = field(repr=False)
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
    measured, simulated, volts = (np.empty((3, ticks, WHEELS)) for _ in range(3))
    fits = Fits.over(signals.encoder_time, ticks, LONG_S)
    borders = np.round(TICK * np.arange(ticks + 1) / simulation.period_s).astype(np.int64)
    borders[-1] = len(inputs)
    before = np.array(path.wheel(at.SHOWN))
    for k, (first, last) in enumerate(pairwise(borders)):
        path.run(inputs[first:last], out[first:last])
        means = Steps.of(out[first:last], WHEELS).shown
        ends[first * steps + 1 : last * steps + 1] = ends[first * steps] + step * np.cumsum(
            means, axis=0
        )
        after = np.array(path.wheel(at.SHOWN))
        until = ends[: last * steps + 1]
        begin, middle, end = at_times(until, step, TICK * np.array([k, k + 0.5, k + 1.0]))
        simulated[:, k] = (end - begin) / TICK, (after - before) / TICK, middle
        measured[:, k] = _seen(fits, k, until, step, simulated[:, k], signals)
        speed, acceleration, angle = measured[:, k]
        half = 0.5 * TICK
        at_end = angle + half * (speed + 0.5 * half * acceleration)
        known = drivers.voltages(
            path,
            at_end.tolist(),
            speed.tolist(),
            simulated=simulated[0, k].tolist(),
            share=float(share[k]),
        )
        volts[:, k] = known.held, known.simulated, known.by_law
        before = after
    variant = Variant(np.asarray(simulation.numbers))
    motion = Motion(variant, from_rest(inputs), Steps.of(out, WHEELS), step, ticks)
    return Expected(motion, WheelEstimate(*measured), WheelEstimate(*simulated), *volts)


def _seen(
    fits: Fits, tick: int, ends: Array, step: float, simulated: Array, signals: Signals
) -> tuple[Array, Array, Array]:
    """Speed, acceleration and angle in the middle of a tick, (3,) each.

    As `EncoderWindow.beside` gives them beside those of a simulated motion, (3, 3).
    """
    index = fits.index[tick]
    ahead = signals.position[index] - at_times(ends, step, signals.encoder_time[index])
    offset, slope, curve = fits.of(tick, ahead)
    speed, acceleration, angle = simulated
    return speed + slope, acceleration + curve, angle + offset
