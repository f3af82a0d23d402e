"""A recording as a fit sees it: power measured and motion of the wheels at the same instants."""

import math

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.span import LEAST, Span, span_of
from tomr_power_model.drive.motion import median_period, wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

TOTAL = WHEELS  # column of the whole robot's power
CHANNELS = WHEELS + 1
_STRETCH_GAP = 0.5  # s without a sample begin another stretch


@frozen
class Samples:
    """Measured power and motion at n instants of one recording."""

    name: str
    time: Array  # s, (n,)
    measured: Array  # W drawn by motors 1-3 and by the whole robot, (n, 4), NaN where unknown
    motion: WheelMotion  # at `parts` points of the sensor's window each, (n * parts, 3)
    parts: int
    stretch: NDArray[np.int64]  # number of the uninterrupted stretch, (n,)
    span: Span = field(factory=lambda: Span(LEAST))  # of the fit to the encoders

    @property
    def mean_motion(self) -> WheelMotion:
        """Motion averaged over the power sensor's window, (n, 3)."""
        shape = (-1, self.parts, WHEELS)
        return WheelMotion(
            self.motion.speed.reshape(shape).mean(axis=1),
            self.motion.acceleration.reshape(shape).mean(axis=1),
        )

    def keep(self, rows: NDArray[np.bool_]) -> "Samples":
        """Some of the instants."""
        points = np.repeat(rows, self.parts)
        return evolve(
            self,
            time=self.time[rows],
            measured=self.measured[rows],
            motion=WheelMotion(self.motion.speed[points], self.motion.acceleration[points]),
            stretch=self.stretch[rows],
        )


def samples_of(
    drive: Drive, robot: Robot, span: float | None = None, window: float | None = None
) -> Samples:
    """Motion where power was measured.

    Instants without a known motion of all wheels are left out.

    Args:
        drive: the recording.
        robot: its description; R and k turn motor currents into power.
        span: of the fit to the encoders [s]; None: as coarse as they are (`span_of`).
        window: over which the power sensor averages before its stamp [s]; None: the robot's.
    """
    window = robot.sensors.power_window if window is None else window
    fitted = span_of(drive) if span is None else Span(span)
    time = np.union1d(drive.power_time, drive.total_time)
    measured = np.full((len(time), CHANNELS), np.nan)
    rows = np.searchsorted(time, drive.power_time)
    measured[rows, :WHEELS] = drive.power
    measured[np.searchsorted(time, drive.total_time), TOTAL] = drive.total
    parts = max(1, math.ceil(window / median_period(drive.encoder_time) - 1e-9))
    back = window * (1.0 - (np.arange(parts) + 0.5) / parts)
    motion = wheel_motion(
        drive.encoder_time,
        drive.position,
        drive.velocity,
        (time[:, None] - back).ravel(),
        fitted.length,
    )
    if robot.measurement.quantity == "motor_current":
        speed = motion.speed.reshape(-1, parts, WHEELS).mean(axis=1)
        measured[:, :WHEELS] = motor_power(robot, measured[:, :WHEELS], speed)
    stretch = np.concatenate([[0], np.cumsum(np.diff(time) > _STRETCH_GAP)])
    samples = Samples(drive.name, time, measured, motion, parts, stretch, fitted)
    known = np.isfinite(motion.speed).all(axis=1).reshape(-1, parts).all(axis=1)
    return samples.keep(known & np.isfinite(measured).any(axis=1))


def motor_power(robot: Robot, current: Array, speed: Array) -> Array:
    """Power at the motors [W] from their current [A] and the modelled voltage, shape (n, 3).

    P = i (R i + k omega); a magnitude of current counts as driving: P = |i| (R |i| + k |omega|).
    """
    resistance = np.array([motor.resistance for motor in robot.motors])
    constant = np.array([motor.wheel_constant for motor in robot.motors])
    if not robot.measurement.signed:
        current, speed = np.abs(current), np.abs(speed)
    return np.asarray(current * (resistance * current + constant * speed))
