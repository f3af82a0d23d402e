"""What the wheels' power monitors make of the wheels' power, tick by tick."""

from collections import deque
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.effects import PlantNumbers
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


class Monitors:
    """Flaws of the monitors in tick means.

    First they follow with their lag, exactly for a power that is constant over each tick; then
    the means are late by the clocks' offset, between ticks by interpolation; last come scale and
    bias. An offset into the future cannot be predicted and counts as none.
    """

    def __init__(self, numbers: PlantNumbers, period_s: float) -> None:
        lag, delay = np.array(numbers.power_lag), np.array(numbers.power_delay)
        slow = lag > 0.0
        rate = np.divide(period_s, lag, out=np.full(len(lag), np.inf), where=slow)
        self._keep = np.exp(-rate)
        self._mean_keep = lag / period_s * (1.0 - self._keep)  # mean of the decay over a tick
        late = np.maximum(delay, 0.0) / period_s
        self._whole = np.floor(late).astype(np.intp)
        self._part = late - self._whole
        self._scale, self._bias = np.array(numbers.power_scale), np.array(numbers.power_bias)
        self._length = int(self._whole.max()) + 2
        self.clear()

    @classmethod
    def of(cls, robot: Robot, period_s: float) -> Self | None:
        """Of a robot, None if its monitors are faultless."""
        flawed = any(effect_id.startswith("sensor.") for effect_id in robot.physics)
        return cls(plant_numbers(vehicle_of(robot)), period_s) if flawed else None

    def clear(self) -> None:
        """Forget what was seen: what a late monitor shows next is not known."""
        self._followed = np.full(len(self._scale), np.nan)
        unknown = [np.full(len(self._scale), np.nan)] * self._length
        self._means = deque(unknown, maxlen=self._length)  # newest first

    def shown(self, power: Sequence[float]) -> list[float]:
        """The next tick's mean power as the monitors show it [W]; NaN where it is not known."""
        given = np.asarray(power, dtype=np.float64)
        gap = np.where(np.isnan(self._followed), 0.0, self._followed - given)
        self._followed = given + self._keep * gap
        self._means.appendleft(given + self._mean_keep * gap)
        means, wheels = np.array(self._means), np.arange(len(given))
        earlier = np.where(self._part > 0.0, means[self._whole + 1, wheels], 0.0)
        value = (1.0 - self._part) * means[self._whole, wheels] + self._part * earlier
        found: list[float] = (self._scale * value + self._bias).tolist()
        return found
