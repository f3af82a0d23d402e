"""How the wheels turn, from what flawed encoders show of it."""

from functools import cached_property
from typing import Self

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.model.encoders import WheelEstimate
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


@frozen
class EncoderFlaws:
    """Flaws that a description holds: `sensor.encoder_scale`, `sensor.encoder_eccentricity`."""

    scale: Array  # angle shown per angle turned, (n,)
    cosine: Array  # of the discs' eccentricity, (n,)
    sine: Array

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Of a robot; without any, the wheels turn as their encoders show."""
        numbers = plant_numbers(vehicle_of(robot))
        cosine, sine = np.array(numbers.encoder_eccentricity).T
        return cls(np.array(numbers.encoder_scale), cosine, sine)

    @cached_property
    def is_none(self) -> bool:
        """Whether the encoders are as they should be."""
        return bool(np.all(self.scale == 1.0)) and not (self.cosine.any() or self.sine.any())

    def angle(self, shown: Array) -> Array:
        """Angles that the wheels have turned [rad], (n,), from those shown."""
        if self.is_none:
            return shown
        off = self.cosine * np.sin(shown) + self.sine * (1.0 - np.cos(shown))
        return np.asarray((shown + off) / self.scale)

    def turned(self, shown: WheelEstimate) -> WheelEstimate:
        """Speed and acceleration of the wheels; the angle stays as shown."""
        if self.is_none:
            return shown
        cos, sin = np.cos(shown.angle), np.sin(shown.angle)
        off, ahead = self.cosine * cos + self.sine * sin, self.sine * cos - self.cosine * sin
        # A disc whose angle is not known is taken for centred.
        rate = (1.0 + np.nan_to_num(off)) / self.scale
        change = np.nan_to_num(ahead) * shown.speed / self.scale
        return evolve(
            shown,
            speed=rate * shown.speed,
            acceleration=rate * shown.acceleration + change * shown.speed,
        )
