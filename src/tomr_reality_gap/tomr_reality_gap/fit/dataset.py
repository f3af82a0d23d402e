"""Recordings to be explained, as numbers."""

from collections.abc import Iterable, Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, Channel
from tomr_reality_gap.alignment.simulation import (
    RecordingSimulation,
    Tick,
    predict_all,
)

Array = NDArray[np.float64]

_DELAY_STEP = 5e-4  # s
# Prior standard deviations of sensor nuisances.
_DELAY_STD = 2e-3  # s, of the response to commands
_CLOCK_STD = 1e-3  # s, of each power sensor's stamps
_GYRO_BIAS = 0.02  # rad/s
_GYRO_SCALE = 0.01


@frozen
class Dataset:
    """All recordings together; rows are the channels of one after another."""

    simulations: tuple[RecordingSimulation, ...]
    channels: tuple[Channel, ...] = field(init=False)
    value: Array = field(init=False)  # measured, (n,)

    def __attrs_post_init__(self) -> None:
        channels = tuple(channel for item in self.simulations for channel in item.channels)
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "value", np.concatenate([item.value for item in channels]))

    def predict(
        self,
        robots: Sequence[Robot],
        tick: Tick = lambda done: None,
        later: Sequence[float] = (),
    ) -> Array:
        """As `RecordingSimulation.predict`, of all recordings' channels, (v + l, n)."""
        return predict_all(self.simulations, robots, tick, later)

    def with_time_derivative(
        self,
        robot: Robot,
        others: Sequence[Robot],
        *,
        scale: Array,
        into: Sequence[NDArray[np.float32]],
        tick: Tick = lambda done: None,
    ) -> tuple[Array, Array]:
        """Values of a robot and their derivative in time, (n,) each.

        Args:
            robot: the robot.
            others: others.
            scale: what each of them changes is multiplied by this, (v,).
            into: where that goes, of each of them, (n,).
            tick: called for each simulated robot.
        """
        value, slope, first = np.empty_like(self.value), np.empty_like(self.value), 0
        for item in self.simulations:
            part = slice(first, first := first + item.size)
            shown = item.predicted([robot, *others], tick, (_DELAY_STEP,))
            value[part] = next(shown)
            for factor, row in zip(scale, into, strict=True):
                row[part] = (next(shown) - value[part]) * factor
            slope[part] = (value[part] - next(shown)) / _DELAY_STEP
        return value, slope

    def changes(self, robot: Robot, torques: Sequence[Iterable[Array]]) -> NDArray[np.float32]:
        """What torques that resist besides change in all values, (v, n).

        Args:
            robot: one robot.
            torques: one iterable per recording, of portions (any, count, 3) that make v in all.
        """
        columns = [
            np.concatenate([item.changes(robot, portion) for portion in portions])
            for item, portions in zip(self.simulations, torques, strict=True)
        ]
        return np.concatenate(columns, axis=1)

    @property
    def sensor_count(self) -> int:
        """How many `sensor_nuisances` there are."""
        own = {**dict.fromkeys(DRAWN_KINDS, 1), "yaw": 2}
        return len(self.simulations) + sum(own.get(channel.kind, 0) for channel in self.channels)

    def sensor_nuisances(self, value: Array, time_derivative: Array) -> Array:
        """Derivatives by what the sensors may be off, in units of prior_stds, (n, k).

        The response of each recording and the stamps of each power sensor in time; each gyro's
        bias and scale.
        """
        columns, row = [], 0

        def add(part: slice, change: Array) -> None:
            column = np.zeros_like(value)
            column[part] = change[part]
            columns.append(column)

        for item in self.simulations:
            add(slice(row, row + item.size), -_DELAY_STD * time_derivative)
            for channel in item.channels:
                part = slice(row, row := row + len(channel.time))
                if channel.kind in DRAWN_KINDS:
                    add(part, -_CLOCK_STD * time_derivative)
                elif channel.kind == "yaw":
                    add(part, np.full_like(value, _GYRO_BIAS))
                    add(part, _GYRO_SCALE * value)
        return np.stack(columns, axis=1)
