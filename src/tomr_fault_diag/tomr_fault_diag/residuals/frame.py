"""The ten residuals of one tick, in the order of Wang 2024, Table 1, and what an IMU and the
drivers' voltages say."""

import math
from collections.abc import Mapping
from typing import Literal

from attrs import frozen

RESIDUALS = 10
TOTAL = 0
MOTORS = range(1, 4)
SPEEDS = range(4, 7)
ENCODERS = range(7, 10)

# The residual that each input of the network is: as the rows of Table 1 mean it and the frame has
# it, and as the text of section 4 lists it. docs/wang2024.md says which holds.
INPUT_ORDERS: Mapping[str, tuple[int, ...]] = {
    "speeds_first": (TOTAL, *MOTORS, *SPEEDS, *ENCODERS),
    "powers_first": (TOTAL, *MOTORS, *ENCODERS, *SPEEDS),
}

BAND_SIGMAS = 3.3  # standard deviations of the noise that a band holds: 99.9 %

YAW = "residuals: yaw rate against the gyro"
ALONG = tuple(f"residuals: acceleration along {axis} against the accelerometer" for axis in "xy")

# Why a residual is unknown: until the first command, and on robots without power of single motors.
NO_FRESH = "no fresh "  # and which input
NO_COMMAND = f"{NO_FRESH}cmd_vel for the model"
NOT_MEASURED = "not measured on this robot"
GAP = "a gap in "  # and which stream: it paused, or went on only just before
SCATTER = "the stamps of joint_states scatter too much to measure a speed"
NOT_BELIEVED = "it has not agreed with the wheels for long enough yet"
NO_IMU = f"{NO_FRESH}imu/data"
NO_ENCODERS = f"{NO_FRESH}joint_states"
NO_WEIGHT = "imu/data does not feel gravity along z"
IMU_REPEATS = "imu/data repeats itself while the robot moves"
IMU_MISTAKEN = "imu/data is not as described"
FROZEN = " repeats itself while the motor works"  # and before it which stream

Unit = Literal["W", "A", "V", "rad/s", "m/s^2"]
UNITS: dict[str, Unit] = {"W": "W", "A": "A", "V": "V", "rad/s": "rad/s", "m/s^2": "m/s^2"}


def rounded(value: float) -> float:
    """A number as it travels in a diagnostic message: six significant digits."""
    return float(f"{value:.6g}")


@frozen
class Residual:
    """Measured minus modelled, its band, and Wang 2024, Eq. 21 of them."""

    residual: float
    band: float
    modelled: float
    unit: Unit = "W"
    missing: str = ""  # what is missing or stale, where the residual is unknown

    @property
    def stale(self) -> bool:
        return self.residual != self.residual or self.band != self.band  # NaN

    @property
    def code(self) -> int:
        """-1, 0 or 1: below, within or above the band; 0 where the residual is unknown."""
        # No comparison holds with NaN, thus an unknown residual is 0.
        return int(self.residual > self.band) - int(-self.residual > self.band)


UNKNOWN_YAW = Residual(math.nan, math.nan, math.nan, "rad/s", NO_IMU)
UNKNOWN_FORCE = Residual(math.nan, math.nan, math.nan, "m/s^2", NO_IMU)
UNKNOWN_VOLTAGE = Residual(math.nan, math.nan, math.nan, "V", NO_COMMAND)


@frozen
class ResidualFrame:
    """Residuals of one tick: total power, motor powers 1-3 (measured - predicted from the
    command), wheel speeds 1-3 (measured - expected, in the expected direction), motor powers 1-3
    (measured - derived from the encoders)."""

    stamp_ns: int
    residuals: tuple[Residual, ...]
    supply: float = float("nan")  # voltage of the supply over the nominal one, where it is measured
    yaw: Residual = UNKNOWN_YAW  # gyro - wheels
    along: tuple[Residual, Residual] = (UNKNOWN_FORCE, UNKNOWN_FORCE)  # accelerometer - wheels
    # Of the drivers of motors 1-3: what they hold - simulated.
    voltages: tuple[Residual, Residual, Residual] = (UNKNOWN_VOLTAGE,) * 3
    mistake: str = ""  # a gross one in robot.yaml or the wiring, in words

    @property
    def codes(self) -> tuple[int, ...]:
        """Input of the paper's network, Wang 2024, Eq. 21."""
        return tuple(residual.code for residual in self.residuals)


def measured_speed(residual: Residual) -> float:
    """What the encoder showed [rad/s]: residuals of speed count in the expected direction."""
    sign = -1.0 if residual.modelled < 0.0 else 1.0
    return residual.modelled + sign * residual.residual


def voltage_names(wheel_topics: tuple[str, str, str]) -> tuple[str, ...]:
    """Stable status names of the drivers' voltages."""
    return tuple(f"residuals: {wheel} voltage of its driver" for wheel in wheel_topics)


def residual_names(wheel_topics: tuple[str, str, str]) -> tuple[str, ...]:
    """Stable status names of the ten residuals."""
    return (
        "residuals: total power",
        *(f"residuals: {wheel} power" for wheel in wheel_topics),
        *(f"residuals: {wheel} speed" for wheel in wheel_topics),
        *(f"residuals: {wheel} power against encoders" for wheel in wheel_topics),
    )
