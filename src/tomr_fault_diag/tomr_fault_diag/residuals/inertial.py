"""What an IMU measures beside what the wheels show, and how its stream does."""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.residuals.accelerometer import AccelerometerWatch, Force, Pair
from tomr_fault_diag.residuals.frame import (
    IMU_MISTAKEN,
    IMU_REPEATS,
    UNKNOWN_FORCE,
    UNKNOWN_YAW,
    Residual,
    ResidualFrame,
)
from tomr_fault_diag.residuals.gyro import GyroWatch
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.drive.mounting import MountingWatch
from tomr_power_model.messages.intake import Triple
from tomr_power_model.model.continuity import POWER_TOLERANCE, Continuity
from tomr_power_model.model.input_health import InputState
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot

IMU = "imu/data"


class InertialWatch:
    """Gyro and accelerometer of one IMU."""

    def __init__(self, robot: Robot, period_ns: int, lately: int) -> None:
        """`period_ns` of the ticks; `lately`: so many of them in which a change counts."""
        self._mounting = MountingWatch(robot)
        self._gyro = GyroWatch(period_ns, lately)
        self._accelerometer = AccelerometerWatch(period_ns, lately)
        self._flow = Continuity(POWER_TOLERANCE)

    def leap(self) -> None:
        """Forget all samples where the stamps leap."""
        self._mounting.clear()
        self._gyro.clear()
        self._accelerometer.clear()
        self._flow.leap()

    @property
    def mistake(self) -> str:
        """In which way it is not as described, and what to mend, in words; empty if it is."""
        return self._mounting.mistake

    def add(self, stamp_ns: int, rate: Triple, force: Force) -> None:
        """Take angular rates [rad/s] and a specific force [m/s^2], NaN for what is not measured."""
        yaw_rate = rate[2]
        if not yaw_rate and not any(force):  # a bus that answers with zeros
            self._flow.refuse("nothing but zeros")
            return
        self._flow.take(stamp_ns)
        self._gyro.add(stamp_ns, yaw_rate)
        self._accelerometer.add(stamp_ns, force)
        self._mounting.add(stamp_ns, (*rate, *force))

    def ignore(self, arrival: Arrival, stamp_ns: int, ahead_ns: int) -> None:
        """Take note of a sample that is left out; one of another clock is so far ahead."""
        self._flow.ignore(arrival, stamp_ns, ahead_ns)

    def residuals(
        self,
        tick_ns: int,
        twist: NDArray[np.float64],
        bands: BandSettings,
        *,
        moves: bool,
        is_well: bool,
    ) -> tuple[Residual, Pair]:
        """At a tick, of the yaw rate [rad/s] and along x and y [m/s^2], of the twist that wheels
        show, (3,); `moves`: whether any turns, `is_well`: whether all is within the bands."""
        self._mounting.look(tick_ns, twist)
        yaw = self._gyro.residual(tick_ns, float(twist[2]), bands, moves=moves)
        along = self._accelerometer.residuals(tick_ns, twist, bands, is_well=is_well)
        if self.mistake:
            unknown = evolve(UNKNOWN_FORCE, missing=IMU_MISTAKEN)
            return evolve(UNKNOWN_YAW, missing=IMU_MISTAKEN), (unknown, unknown)
        return yaw, along

    def states(self, tick_ns: int, frame: ResidualFrame) -> list[InputState]:
        """What is to be said of the stream at a tick, if there was one: a robot need not have an
        IMU."""
        repeats = IMU_REPEATS in (frame.yaw.missing, frame.along[0].missing)
        ailment = IMU_REPEATS.removeprefix(f"{IMU} ") if repeats else ""
        # Wheels that are not as described show no IMU.
        ailment = ailment if repeats or frame.mistake else self.mistake
        was_heard = self._flow.last(tick_ns) or self._flow.ahead
        return [InputState(IMU, self._flow, ailment)] if was_heard else []
