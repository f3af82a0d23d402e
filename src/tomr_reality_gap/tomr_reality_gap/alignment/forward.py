"""What the channels of a recording would show, had the robot been another one.

The commands of the recording drive the closed loop of each robot; angle and energy, added up over
driver periods, are read at the channels' times:

    value = (S(t) - S(t - span)) / span,   S the angle [rad], energy [J], ... at a time
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from attrs import evolve, fields, frozen
from numpy.typing import NDArray
from scipy.signal import lfilter

from tomr_power_model.drive.record import Drive
from tomr_power_model.physics.effects import COPPER, Effect, acting, stacked_effects
from tomr_power_model.response.many import ManyLoops, Runs, Stretches
from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.alignment.channels import Channel, Kind
from tomr_reality_gap.alignment.stretches import (
    Timeline,
    ramped,
    stretches_of,
    timeline_of,
)

Array = NDArray[np.float64]

HEATING, SLIP = "electrical.winding_heating", "contact.slip"
_HEATING_ROUNDS = 5  # heat raises the loss that makes it
_MOST_CELLS = 4_000_000  # of one quantity at a time: bounds the memory
_FEW_CELLS = 200_000  # of one robot in recordings that run side by side
_GRID = 0.02  # s, of delays that are simulated; what is between them is read earlier or later
# Names of the channels' kinds among what comes out of a run.
_RUN: Mapping[Kind, str] = MappingProxyType(
    {
        "speed": "speed",
        "power": "power",
        "voltage": "voltage",
        "yaw": "yaw_rate",
        "current": "current",
    }
)


@frozen
class Forward:
    """Simulates the channels of one recording; `robot` is what the drivers believe."""

    recorded: Drive
    robot: Robot
    channels: tuple[Channel, ...]
    timeline: Timeline
    delay: float = 0.0  # of the response to commands, beyond the description [s]
    resisting: Array | None = None  # torques that no description holds [N m], (count, 3)

    @classmethod
    def of(cls, recorded: Drive, robot: Robot, channels: tuple[Channel, ...]) -> "Forward":
        """Prepare a recording."""
        line = timeline_of(recorded, robot)
        end = line.start + line.period * line.count
        inside = tuple(_inside(channel, line.start, end) for channel in channels)
        return cls(recorded, robot, tuple(c for c in inside if len(c.time)), line)

    def predict(
        self,
        robots: Sequence[Robot],
        tick: Callable[[int], None] = lambda done: None,
        later: Sequence[float] = (),
    ) -> Array:
        """Values of all channels one after another, for each robot, (v + l, n).

        The last l rows are those of the first robot, did it respond later by so much [s].
        """
        return predict_all((self,), robots, tick, later)

    def respond(self, robot: Robot, torques: Array) -> Array:
        """Values of all channels where torques resist besides, (v, n).

        Args:
            robot: one robot.
            torques: of each wheel in each driver period [N m], (v, count, 3).
        """
        return respond_all((self,), robot, (torques,))

    def run(self, robot: Robot) -> dict[str, Array]:
        """Means over driver periods: speed, power, copper (n, 3), voltage, yaw_rate (n,)."""
        runs = self._run([robot])
        return {
            name: self._per_period(getattr(runs, name))
            for name in ("speed", "power", "copper", "voltage", "yaw_rate")
        }

    def _stretches(self, robot: Robot) -> Stretches:
        delay = self.robot.controller.delay + self.late(robot)
        believed = evolve(self.robot, controller=evolve(robot.controller, delay=delay))
        twist = ramped(self.recorded, believed, self.timeline)
        found = stretches_of(self.recorded, self.robot, self.timeline, twist)
        torque = None if self.resisting is None else self._cut(self.resisting[None])
        prompt = self.robot.controller.integrator == "backward"
        return evolve(found, prompt=prompt, torque=torque)

    def late(self, robot: Robot) -> float:
        """How much later than described the commands of a robot come, in whole `_GRID` [s]."""
        grid = self.timeline.period * max(1, round(_GRID / self.timeline.period))
        return grid * round((robot.controller.delay - self.robot.controller.delay) / grid)

    def _rest(self, robot: Robot) -> float:
        """The rest of its delay, by which everything is read earlier [s]."""
        return robot.controller.delay - self.robot.controller.delay - self.late(robot)

    @property
    def cells(self) -> int:
        """Numbers that one quantity of one robot takes."""
        line = self.timeline
        return len(line.first) * (line.warm + line.length) * WHEELS

    def stretches(self, robots: Sequence[Robot]) -> Stretches:
        """What drives robots that are told alike and are all heated or all not."""
        stretches = self._stretches(robots[0])
        if HEATING in robots[0].physics:
            physics = {key: at for key, at in robots[0].physics.items() if key != HEATING}
            cold = ManyLoops.of([evolve(robots[0], physics=physics)]).run(stretches)
            copper = self._per_period(cold.copper)
            warm = np.stack([self._warm(robot, copper) for robot in robots])
            stretches = evolve(stretches, warm=warm)
        return stretches

    def _run(self, robots: Sequence[Robot]) -> Runs:
        return ManyLoops.of(robots).run(self.stretches(robots))

    def resisted(self, robot: Robot, torques: Array) -> Stretches:
        """What drives a robot where torques resist besides, (v, count, 3) [N m]."""
        known = 0.0 if self.resisting is None else self.resisting
        return evolve(self._stretches(robot), torque=self._cut(torques + known))

    def _cut(self, torques: Array) -> Array:
        """Torques (v, count, 3) as stretches have them; what was before is as at the start."""
        before = np.repeat(torques[:, :1], self.timeline.warm, axis=1)
        whole = np.concatenate([before, torques], axis=1)
        return np.stack([self.timeline.cut(torque) for torque in whole])

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

    def read(self, robots: Sequence[Robot], runs: Runs) -> Array:
        """Values of all channels in runs of this recording's stretches, (v, n)."""
        line = self.timeline
        sensors = stacked_effects(robots)
        kinds = {channel.kind for channel in self.channels}
        drawn = kinds & {"power", "total"}
        joined = {
            kind: line.joined(getattr(runs, name))
            for kind, name in _RUN.items()
            if kind in kinds or (kind == "power" and drawn)
        }
        if "current" in kinds and not self.robot.measurement.signed:
            joined["current"] = np.abs(joined["current"])
        late = np.array([self._rest(robot) for robot in robots])
        tilts = {"power": line.joined(runs.tilt)} if drawn else {}
        if "total" in kinds:
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
                value = self._monitored(channel, series, tilt, sensors, late)
            else:
                value = self._mean(channel, series, tilt, late)
            columns.append(value)
        return np.concatenate(columns, axis=1)

    def _mean(self, channel: Channel, series: Array, tilt: Array, delay: Array) -> Array:
        """Means over the spans that end at the channel's times, (v, n); delay (1,) or (v,)."""
        line = self.timeline
        if len(delay) > 1 and np.ptp(delay) > 0.0:
            found = np.empty((len(delay), len(channel.time)))
            for own in np.unique(delay):
                rows = np.flatnonzero(delay == own)
                part = tilt if tilt.ndim < 2 else tilt[rows]
                found[rows] = self._mean(channel, series[rows], part, np.array([own]))
            return found
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
        self,
        channel: Channel,
        series: Array,
        tilt: Array,
        sensors: Sequence[Effect],
        late: Array,
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
        delay = sum((np.asarray(e.delayed())[:, 0, wheel] for e in hooks["delayed"]), late)
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


def predict_all(
    forwards: Sequence[Forward],
    robots: Sequence[Robot],
    tick: Callable[[int], None] = lambda done: None,
    later: Sequence[float] = (),
) -> Array:
    """As `Forward.predict`, of recordings one after another; short ones run side by side."""
    return np.concatenate(
        [_predicted(bundle, robots, tick, later) for bundle in _bundles(forwards)], axis=1
    )


def _predicted(
    bundle: Sequence[Forward],
    robots: Sequence[Robot],
    tick: Callable[[int], None],
    later: Sequence[float],
) -> Array:
    most = max(1, _MOST_CELLS // sum(item.cells for item in bundle))
    size = sum(len(channel.time) for item in bundle for channel in item.channels)
    found = np.empty((len(robots) + len(later), size))
    for rows in _groups(robots, bundle[0], most):
        group = [robots[row] for row in rows]
        runs = _side_by_side(group, bundle, [item.stretches(group) for item in bundle])
        parts = list(zip(bundle, runs, strict=True))
        found[rows] = np.concatenate([item.read(group, run) for item, run in parts], axis=1)
        if rows[0] == 0:
            for row, delay in enumerate(later, len(robots)):
                late = [(evolve(item, delay=item.delay + delay), run) for item, run in parts]
                first = [item.read(group[:1], _of(run, slice(1)))[0] for item, run in late]
                found[row] = np.concatenate(first)
        tick(len(group) * len(bundle))
    return found


def respond_all(forwards: Sequence[Forward], robot: Robot, torques: Sequence[Array]) -> Array:
    """As `Forward.respond`, of recordings one after another; short ones run side by side."""
    columns, first = [], 0
    for bundle in _bundles(forwards):
        own = torques[first : (first := first + len(bundle))]
        most = max(1, _MOST_CELLS // sum(item.cells for item in bundle))
        parts = []
        for row in range(0, len(own[0]), most):
            drives = [
                item.resisted(robot, torque[row : row + most])
                for item, torque in zip(bundle, own, strict=True)
            ]
            runs = _side_by_side([robot], bundle, drives)
            pairs = zip(bundle, runs, strict=True)
            parts.append(np.concatenate([item.read([robot], run) for item, run in pairs], axis=1))
        columns.append(np.concatenate(parts))
    return np.concatenate(columns, axis=1)


def _side_by_side(
    robots: Sequence[Robot], bundle: Sequence[Forward], drives: Sequence[Stretches]
) -> list[Runs]:
    """Runs of each recording, all stretches simulated at once."""
    together = ManyLoops.of(robots).run(drives[0] if len(drives) == 1 else _joined(drives))
    found, first = [], 0
    for item in bundle:
        columns = slice(first, first := first + len(item.timeline.first))
        found.append(_of(together, stretches=columns))
    return found


def _joined(drives: Sequence[Stretches]) -> Stretches:
    """Stretches of several recordings, equally long, as those of one."""

    def along(name: str, axis: int) -> Array:
        return np.concatenate([getattr(item, name) for item in drives], axis=axis)

    return Stretches(
        set_speed=along("set_speed", 1),
        speed=along("speed", 0),
        acceleration=along("acceleration", 0),
        angle=along("angle", 0),
        heading=along("heading", 0),
        warm=None if drives[0].warm is None else along("warm", 1),
        prompt=drives[0].prompt,
        torque=None if drives[0].torque is None else along("torque", 1),
        told=None if drives[0].told is None else along("told", 0),
    )


def _of(runs: Runs, robots: slice = slice(None), stretches: slice = slice(None)) -> Runs:
    """Some of the robots and of the stretches."""
    return Runs(
        **{item.name: getattr(runs, item.name)[:, robots, stretches] for item in fields(Runs)}
    )


def _bundles(forwards: Sequence[Forward]) -> Iterator[list[Forward]]:
    """Recordings that run side by side, stretches of the same length: a step in Python costs much
    more than the arithmetic of a few more stretches."""
    bundle: list[Forward] = []
    for item in forwards:
        if bundle and sum(other.cells for other in [*bundle, item]) > _FEW_CELLS:
            yield _even(bundle)
            bundle = []
        bundle.append(item)
    if bundle:
        yield _even(bundle)


def _even(bundle: Sequence[Forward]) -> list[Forward]:
    longest = max(item.timeline.length for item in bundle)
    return [evolve(item, timeline=evolve(item.timeline, length=longest)) for item in bundle]


def _groups(robots: Sequence[Robot], forward: Forward, most: int) -> Iterator[list[int]]:
    """Rows of robots that can run together, at most so many at a time."""
    alike: dict[tuple[float, float, bool, bool], list[int]] = {}
    for row, robot in enumerate(robots):
        told = robot.controller.acceleration_limit, forward.late(robot)
        kind = *told, HEATING in robot.physics, SLIP in robot.physics
        alike.setdefault(kind, []).append(row)
    for rows in alike.values():
        yield from (rows[first : first + most] for first in range(0, len(rows), most))
