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
from tomr_power_model.dynamics.numbers import laid_out, timing_of
from tomr_power_model.dynamics.simulation import Excitation, Steps, Variant
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.encoders import LONG_S
from tomr_power_model.model.resting import RestingDrivers
from tomr_power_model.robot import WHEELS
from tomr_training.drives import Drive
from tomr_training.planar.fits import Fits
from tomr_training.planar.plant import Motion, at_times
from tomr_training.planar.schedule import TICK, commanded, tick_count
from tomr_training.planar.sensors import Signals

Array = NDArray[np.float64]


@frozen
class Expected:
    """What is expected of a drive."""

    motion: Motion
    held: Array = field(repr=False)  # voltages of the drivers, as the power sensors see them [V]


class _Path:
    """A simulation in progress, as `RestingDrivers` looks at it."""

    def __init__(self, variant: Variant, wheels: int) -> None:
        self.state = np.zeros(at.state_size(wheels))
        self._numbers, self._wheels = variant.numbers, wheels
        most = max(at.input_size(wheels), at.MOTION_HEADER + wheels * at.MOTION_WHEEL)
        self._scratch = np.zeros((3, most))
        self._nothing = np.zeros((0, wheels))
        compiled().begin(variant.numbers, self.state, *self._scratch[1:], wheels)

    def wheel(self, part: int) -> list[float]:
        """A field of the wheels' state."""
        found: list[float] = self.state[at.STATE_HEADER + part :: at.STATE_WHEEL].tolist()
        return found

    def add_to_sum(self, wheel: int, angle: float) -> None:
        """Add to what a wheel's driver has summed up of its errors [rad]."""
        self.state[at.STATE_HEADER + wheel * at.STATE_WHEEL + at.INTEGRAL] += angle

    def run(self, inputs: Array, out: Array) -> None:
        """Drive through some periods."""
        numbers, scratch = self._numbers, self._scratch[0]
        compiled().run(numbers, self.state, inputs, self._nothing, 0, out, scratch, self._wheels)


def run_believed(drive: Drive, signals: Signals, share: Array) -> Expected:
    """Drive the robot as it is described, with the commands and nothing else.

    `share`: of each tick that has passed in the middle of what its power samples average, (ticks,).
    """
    robot, ticks = drive.believed, tick_count(drive)
    inputs, nothing = commanded(drive, robot), np.zeros(3)
    excitation = Excitation(0.0, inputs, nothing, nothing, 0.0, np.zeros(WHEELS))
    variant, step = Variant(laid_out(vehicle_of(robot))), timing_of(robot.controller.rate).step
    path = _Path(variant, WHEELS)
    drivers = RestingDrivers(robot)
    steps = int(variant.numbers[at.SUBSTEPS])
    out = np.empty((len(inputs), steps * at.output_size(WHEELS)))
    ends, held = np.zeros((len(inputs) * steps + 1, WHEELS)), np.empty((ticks, WHEELS))
    fits = Fits.over(signals.encoder_time, ticks, LONG_S)
    borders = np.round(TICK * np.arange(ticks + 1) / (steps * step)).astype(np.int64)
    borders[-1] = len(inputs)
    before = np.array(path.wheel(at.SPEED))
    for k, (first, last) in enumerate(pairwise(borders)):
        path.run(inputs[first:last], out[first:last])
        speed = Steps.of(out[first:last], WHEELS).speed
        ends[first * steps + 1 : last * steps + 1] = ends[first * steps] + step * np.cumsum(
            speed, axis=0
        )
        after = np.array(path.wheel(at.SPEED))
        angle, seen = _seen(fits, k, ends[: last * steps + 1], step, (before, after), signals)
        held[k] = drivers.voltages(path, angle.tolist(), seen.tolist(), float(share[k]))
        before = after
    return Expected(Motion(variant, excitation, Steps.of(out, WHEELS), step, ticks), held)


def _seen(
    fits: Fits, tick: int, ends: Array, step: float, speeds: tuple[Array, Array], signals: Signals
) -> tuple[Array, Array]:
    """Angle at the end of a tick and mean speed in it, as `EncoderWindow.beside`, (3,) each."""
    edges = TICK * np.array([tick, tick + 0.5, tick + 1.0])
    start, middle, end = at_times(ends, step, edges)
    index = fits.index[tick]
    ahead = signals.position[index] - at_times(ends, step, signals.encoder_time[index])
    offset, slope, curve = fits.of(tick, ahead)
    speed = (end - start) / TICK + slope
    acceleration = (speeds[1] - speeds[0]) / TICK + curve
    half = 0.5 * TICK
    return middle + offset + half * (speed + 0.5 * half * acceleration), speed
