"""What was true at a tick, and whether anybody could have known.

A fault is observable where it moves something that is measured: the power of a motor or a reported
wheel speed differs from what the same robot does in the same drive without the fault, both free of
sensor noise, by more than

    tolerance = 3 sigma of the sensor + what a healthy robot may be off its description

in each of the last 0.2 s: a bump in healthy driving is over sooner. The second part is what 99 %
of ticks of healthy robots stay within, whose every value is up to 5 % off and which carry up to
10 % of payload. A slippery floor must make a wheel slip besides. No classifier has a say in this.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.widths import moved, transient_ticks
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LATELY = transient_ticks(to_ns(0.05))  # ticks of 50 ms, in which a change counts
_SIGMAS = 3.0
_POWER_SHARE = 0.15  # of the power of the healthy robot
_POWER_CHANGE = 0.10  # of its change over those ticks
_SPEED_LEAST = 0.01  # rad/s
_SPEED_SHARE = 0.002  # of the speed of the healthy robot
_SPEED_CHANGE = 0.05  # of its change over those ticks
_SAMPLES = 2.5  # of power in a tick
# Standard deviation of a speed fitted to encoders, per quantum [1/s]: 7 samples in 70 ms.
_SPEED_PER_QUANTUM = 10.0
SLIPPING = 0.02  # m/s
LASTING = 4  # ticks of 50 ms


@frozen
class GroundTruth:
    """What really happened in each tick, without any sensor's noise."""

    power: Array  # drawn by each driver [W], (ticks, 3)
    speed: Array  # that an ideal reading of the encoders gives [rad/s], (ticks, 3)
    slip: Array  # of each contact in its rolling direction [m/s], (ticks, 3)

    def of_ticks(self, rows: NDArray[np.int64]) -> "GroundTruth":
        """The truth of some ticks."""
        return GroundTruth(self.power[rows], self.speed[rows], self.slip[rows])


@frozen
class Noise:
    """Standard deviations of what is measured in a tick."""

    power: float  # W
    speed: float  # rad/s

    @classmethod
    def of(cls, robot: Robot) -> "Noise":
        """Noise of the sensors of a robot."""
        power = robot.supply.nominal_voltage * robot.sensors.current_noise
        return cls(
            power / math.sqrt(_SAMPLES), _SPEED_PER_QUANTUM * robot.sensors.encoder_resolution
        )


def deviates(truth: GroundTruth, twin: GroundTruth, noise: Noise) -> Flags:
    """Whether a tick differs measurably from the healthy twin, (ticks,)."""
    power_tolerance = (
        _SIGMAS * noise.power
        + _POWER_SHARE * np.abs(twin.power)
        + _POWER_CHANGE * moved(twin.power, LATELY)
    )
    speed_tolerance = (
        _SIGMAS * noise.speed
        + _SPEED_LEAST
        + _SPEED_SHARE * np.abs(twin.speed)
        + _SPEED_CHANGE * moved(twin.speed, LATELY)
    )
    differs = np.abs(truth.power - twin.power) > power_tolerance
    differs |= np.abs(truth.speed - twin.speed) > speed_tolerance
    return np.asarray(differs.any(axis=1))


def lasting(flags: Flags) -> Flags:
    """Where flags hold in each of the last 0.2 s, (ticks, ...)."""
    held = flags.copy()
    for back in range(1, LASTING):
        held[back:] &= flags[:-back]
        held[:back] = False
    return held
