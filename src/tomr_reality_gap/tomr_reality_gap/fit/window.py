"""Over how long power sensors average, where that is not as described.

Read off the simulation as described: its power, averaged so, has to look like what was measured but
for a factor and an offset, which other physics may make; better than it does late, or lagging, as
`sensor.clock_offset` and `sensor.power_lag` have it.
"""

from collections.abc import Callable, Iterable

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.simulation import RecordingSimulation

Array = NDArray[np.float64]

WINDOW = "sensors.power_window"
_TRIED = tuple(np.geomspace(0.02, 1.0, 24))  # s: windows, delays and time constants
_LONGER = 2.0  # than described, at least
_BETTER = 0.5  # of what is left as described
_CLEARER = 0.8  # of what a delay or a lag leaves
_FEWEST = 200  # samples of a channel
_DIGITS = 2


@frozen
class _Drawn:
    """A channel, and what it draws in the simulation."""

    channel: Channel
    begin: float  # of the first driver period [s]
    period: float  # s
    power: Array  # means over driver periods, (k,)

    def left(self, window: float, delay: float = 0.0, lag: float = 0.0) -> float:
        """Share of the variance that is none of the simulated, averaged [s], late [s] and lagging
        [s]."""
        power = self.power
        if lag:
            power = _lagging(power, self.period / lag)
        sums = np.concatenate([[0.0], np.cumsum(power) * self.period])
        edges = self.begin + self.period * np.arange(len(sums))
        end = self.channel.time - delay
        shown = np.interp(end, edges, sums) - np.interp(end - window, edges, sums)
        measured = self.channel.value - np.mean(self.channel.value)
        shown = shown - np.mean(shown)
        sizes = float((measured @ measured) * (shown @ shown))
        return 1.0 - max(float(measured @ shown), 0.0) ** 2 / sizes if sizes else 1.0


def window_of(simulation: RecordingSimulation) -> float | None:
    """What the sensors average over [s]; None where it is as described, or does not show."""
    robot = simulation.robot
    drawn = _drawn(simulation) if robot.measurement.signed else []
    if not drawn:
        return None
    given = robot.sensors.power_window

    def least(
        tried: Iterable[float], left: Callable[[_Drawn, float], float]
    ) -> tuple[float, float]:
        return min((float(np.mean([left(item, one) for item in drawn])), one) for one in tried)

    described, _ = least([given], lambda item, one: item.left(one))
    longer = [one for one in _TRIED if one > _LONGER * given]
    averaged, window = least(longer, lambda item, one: item.left(one))
    late, _ = least(_TRIED, lambda item, one: item.left(given, delay=one))
    lagging, _ = least(_TRIED, lambda item, one: item.left(given, lag=one))
    if averaged > _BETTER * described or averaged > _CLEARER * min(late, lagging):
        return None
    fine = np.minimum(window * np.linspace(0.85, 1.15, 31), _TRIED[-1])
    return round(float(least(fine, lambda item, one: item.left(one))[1]), _DIGITS)


def _lagging(power: Array, share: float) -> Array:
    """Through a first-order lag, so much of its time constant a period; from rest, (k,)."""
    size = 2 * len(power)  # what is late does not come round to the start
    kernel = -np.expm1(-share) * np.exp(-share * np.arange(len(power)))
    found = np.fft.irfft(np.fft.rfft(power, size) * np.fft.rfft(kernel, size), size)
    return np.asarray(found[: len(power)])


def _drawn(simulation: RecordingSimulation) -> list[_Drawn]:
    run, line = simulation.run(simulation.robot), simulation.timeline
    whole = run.power.sum(axis=1)
    found = []
    for channel in simulation.channels:
        if channel.kind == "total":
            power = whole
        elif channel.kind in ("power", "current") and channel.wheel is not None:
            power = (run.power if channel.kind == "power" else run.current)[:, channel.wheel]
        else:
            continue
        if len(channel.time) >= _FEWEST:
            found.append(_Drawn(channel, line.start, line.period, power))
    return found
