"""What the channels of a recording would show, had the robot been another one.

The commands of the recording drive the closed loop of each robot; angle and energy, added up over
driver periods, are read at the channels' times:

    value = (S(t) - S(t - span)) / span,   S the angle [rad], energy [J], ... at a time
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from scipy.signal import lfilter

from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.physics.effects import COPPER, Effect, acting, stacked_effects
from tomr_power_model.response.many import ManyLoops, Runs, Stretches
from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.stretches import (
    Timeline,
    ramped,
    stretches_of,
    timeline_of,
)

Array = NDArray[np.float64]

HEATING = "electrical.winding_heating"
_HEATING_ROUNDS = 5  # heat raises the loss that makes it
_MOST_CELLS = 4_000_000  # of one quantity at a time: bounds the memory


@frozen
class Forward:
    """Simulates the channels of one recording; `robot` is what the drivers believe."""

    recorded: Recorded
    robot: Robot
    channels: tuple[Channel, ...]
    timeline: Timeline
    delay: float = 0.0  # of the response to commands, beyond the description [s]
    prompt: bool = False  # see `response.many.Stretches`

    @classmethod
    def of(cls, recorded: Recorded, robot: Robot, channels: tuple[Channel, ...]) -> "Forward":
        """Prepare a recording."""
        line = timeline_of(recorded, robot)
        end = line.start + line.period * line.count
        inside = tuple(_inside(channel, line.start, end) for channel in channels)
        return cls(recorded, robot, tuple(c for c in inside if len(c.time)), line)

    def predict(
        self, robots: Sequence[Robot], tick: Callable[[int], None] = lambda done: None
    ) -> Array:
        """Values of all channels one after another, for each robot, (v, n)."""
        line = self.timeline
        cells = len(line.first) * (line.warm + line.length) * 3
        most = max(1, _MOST_CELLS // cells)
        found = np.empty((len(robots), sum(len(channel.time) for channel in self.channels)))
        for rows in _groups(robots, most):
            group = [robots[row] for row in rows]
            found[rows] = self._read(group, self._run(group))
            tick(len(group))
        return found

    def respond(self, robot: Robot, torques: Array) -> Array:
        """Values of all channels where torques resist besides, (v, n).

        Args:
            robot: one robot.
            torques: of each wheel in each driver period [N m], (v, count, 3).
        """
        line = self.timeline
        cells = len(line.first) * (line.warm + line.length) * 3
        most = max(1, _MOST_CELLS // cells)
        stretches = self._stretches(robot)
        parts = []
        for first in range(0, len(torques), most):
            cut = [
                line.cut(np.concatenate([np.repeat(torque[:1], line.warm, axis=0), torque]))
                for torque in torques[first : first + most]
            ]
            runs = ManyLoops.of([robot]).run(evolve(stretches, torque=np.stack(cut)))
            parts.append(self._read([robot], runs))
        return np.concatenate(parts)

    def run(self, robot: Robot) -> dict[str, Array]:
        """Means over driver periods: speed, power, copper (n, 3), voltage, yaw_rate (n,)."""
        runs = self._run([robot])
        return {
            name: self._per_period(getattr(runs, name))
            for name in ("speed", "power", "copper", "voltage", "yaw_rate")
        }

    def _stretches(self, robot: Robot) -> Stretches:
        believed = evolve(self.robot, controller=robot.controller)
        twist = ramped(self.recorded, believed, self.timeline)
        found = stretches_of(self.recorded, self.robot, self.timeline, twist)
        return evolve(found, prompt=self.prompt)

    def _run(self, robots: Sequence[Robot]) -> Runs:
        """Simulate robots that ramp alike and are all heated or all not."""
        stretches = self._stretches(robots[0])
        if HEATING in robots[0].physics:
            physics = {key: at for key, at in robots[0].physics.items() if key != HEATING}
            cold = ManyLoops.of([evolve(robots[0], physics=physics)]).run(stretches)
            copper = self._per_period(cold.copper)
            warm = np.stack([self._warm(robot, copper) for robot in robots])
            stretches = evolve(stretches, warm=warm)
        return ManyLoops.of(robots).run(stretches)

    def _per_period(self, pieces: Array) -> Array:
        """Means over driver periods of the first robot, (count, ...)."""
        joined = self.timeline.joined(pieces)[:, 0]
        return np.asarray(joined.reshape(self.timeline.count, -1, *joined.shape[1:]).mean(axis=1))

    def _warm(self, robot: Robot, copper: Array) -> Array:
        """Winding temperature above 25 C [K] in each period, from cold losses, (c, s, 3)."""
        line = self.timeline
        rise = np.zeros((line.count, WHEELS))
        for wheel in range(WHEELS):
            heating = robot.effect(HEATING, wheel)
            if heating is None:
                continue
            keep = float(np.exp(-line.period / max(heating["time_constant"], line.period)))
            settled = heating["thermal_resistance"] * copper[:, wheel]
            for _ in range(_HEATING_ROUNDS):
                hot = settled * (1.0 + COPPER * rise[:, wheel])
                rise[:, wheel] = lfilter(
                    [1.0 - keep], [1.0, -keep], hot, zi=[keep * heating["initial"]]
                )[0]
        return line.cut(np.concatenate([np.repeat(rise[:1], line.warm, axis=0), rise]))

    def _read(self, robots: Sequence[Robot], runs: Runs) -> Array:
        line = self.timeline
        sensors = stacked_effects(robots)
        joined = {
            "speed": line.joined(runs.speed),
            "power": line.joined(runs.power),
            "voltage": line.joined(runs.voltage),
            "yaw": line.joined(runs.yaw_rate),
        }
        tilts = {"power": line.joined(runs.tilt)}
        tilts["total"] = tilts["power"].sum(axis=2)
        auxiliary = np.array([robot.supply.auxiliary_power for robot in robots])
        joined["total"] = joined["power"].sum(axis=2) + auxiliary
        columns = []
        for channel in self.channels:
            series = joined[channel.kind]
            if channel.wheel is not None:
                series = series[..., channel.wheel]
            series = np.ascontiguousarray(series.T)
            tilt = tilts.get(channel.kind, np.zeros(1))
            if tilt.ndim == 3:
                tilt = tilt[..., channel.wheel]
            tilt = np.ascontiguousarray(tilt.T)
            if channel.kind == "power":
                columns.append(self._monitored(channel, series, tilt, sensors))
            else:
                columns.append(self._mean(channel, series, tilt, np.zeros(1)))
        return np.concatenate(columns, axis=1)

    def _mean(self, channel: Channel, series: Array, tilt: Array, delay: Array) -> Array:
        """Means over the spans that end at the channel's times, (v, n); delay (1,) or (v,)."""
        line = self.timeline
        if len(delay) > 1 and np.ptp(delay) > 0.0:
            rows = [
                self._mean(channel, series[[v]], tilt if tilt.ndim < 2 else tilt[[v]], delay[[v]])
                for v in range(len(delay))
            ]
            return np.concatenate(rows)
        step = line.period * line.count / series.shape[1]
        # What has no span is read at an instant: a mean around it, not before it.
        span = np.where(channel.span > 0.0, channel.span, step)
        late = np.where(channel.span > 0.0, 0.0, 0.5 * step)
        end = channel.time - self.delay - delay[0] + late
        total = step * np.cumsum(series, axis=1)
        change = self._sum_at(series, tilt, total, end)
        change -= self._sum_at(series, tilt, total, end - span)
        return np.asarray(change / span)

    def _sum_at(self, series: Array, tilt: Array, total: Array, time: Array) -> Array:
        """Integral from the start to a time; `total` to the end of each step.

        Within a step the quantity runs straight through its mean, by `tilt` from start to end.
        """
        line, count = self.timeline, series.shape[1]
        step = line.period * line.count / count
        place = np.clip((time - line.start) / step, 0.0, count - 1e-6)
        index = place.astype(np.intp)
        left = index + 1.0 - place
        found = total[:, index] - left * step * series[:, index]
        if tilt.ndim > 1:
            found -= 0.5 * left * (1.0 - left) * step * tilt[:, index]
        return np.asarray(found)

    def _monitored(
        self, channel: Channel, series: Array, tilt: Array, sensors: Sequence[Effect]
    ) -> Array:
        """A wheel's power as its monitor reports it, flaws included."""
        wheel = channel.wheel
        assert wheel is not None
        hooks = acting(sensors)
        lag = sum((np.asarray(e.lag())[:, 0, wheel] for e in hooks["lag"]), np.zeros(1))
        slow = np.flatnonzero(np.asarray(lag) > 0.0)
        if len(slow):
            step = self.timeline.period * self.timeline.count / series.shape[1]
            series, tilt = series.copy(), tilt.copy()
            tilt[slow] = 0.0
            for variant in slow:
                series[variant] = _lagged(series[variant], step / float(lag[variant]))
        delay = sum((np.asarray(e.delayed())[:, 0, wheel] for e in hooks["delayed"]), np.zeros(1))
        values = self._mean(channel, series, tilt, np.asarray(delay))
        wide = np.repeat(values[:, :, None], 3, axis=2)
        for effect in hooks["reported"]:
            wide = effect.reported(wide)
        return np.asarray(wide[..., wheel])


def _inside(channel: Channel, start: float, end: float) -> Channel:
    """Without what was measured before the encoders began or after all else had ended."""
    rows = (channel.time - channel.span >= start) & (channel.time <= end)
    if rows.all():
        return channel
    time, span, value = channel.time[rows], channel.span[rows], channel.value[rows]
    return evolve(channel, time=time, span=span, value=value)


def _lagged(series: Array, share: float) -> Array:
    """First-order lag of a series; `share` is its step over the time constant."""
    keep = float(np.exp(-share))
    filtered, _ = lfilter([1.0 - keep], [1.0, -keep], series, zi=[keep * series[0]])
    return np.asarray(filtered)


def _groups(robots: Sequence[Robot], most: int) -> Iterator[list[int]]:
    """Rows of robots that can run together, at most so many at a time."""
    alike: dict[tuple[float, bool], list[int]] = {}
    for row, robot in enumerate(robots):
        kind = robot.controller.acceleration_limit, HEATING in robot.physics
        alike.setdefault(kind, []).append(row)
    for rows in alike.values():
        yield from (rows[first : first + most] for first in range(0, len(rows), most))
