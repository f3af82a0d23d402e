"""Flaws of the power measurement, not of the robot: they act on what a monitor reports."""

import numpy as np
from attrs import frozen

from tomr_power_model.physics.effects.base import Array, Effect, effect


@effect("sensor.power_scale")
@frozen
class PowerScale(Effect):
    """A wheel's monitor reports `scale` times the power."""

    scale: Array

    def reported(self, power: Array) -> Array:
        return np.asarray(self.scale * power)


@effect("sensor.power_bias")
@frozen
class PowerBias(Effect):
    """A wheel's monitor reports `power` more than there is."""

    power: Array  # W

    def reported(self, power: Array) -> Array:
        return np.asarray(power + self.power)


@effect("sensor.power_lag")
@frozen
class PowerLag(Effect):
    """A wheel's monitor follows the power with a first-order lag."""

    time_constant: Array  # s

    def lag(self) -> Array:
        return self.time_constant


@effect("sensor.clock_offset")
@frozen
class ClockOffset(Effect):
    """The value that a monitor stamps t is that of t - delay."""

    delay: Array  # s

    def delayed(self) -> Array:
        return self.delay
