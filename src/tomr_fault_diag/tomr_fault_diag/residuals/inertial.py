"""What an IMU measures beside what the wheels show, and how its stream does."""

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.residuals.accelerometer import AccelerometerWatch, Force, Pair
from tomr_fault_diag.residuals.frame import IMU_REPEATS, Residual, ResidualFrame
from tomr_fault_diag.residuals.gyro import GyroWatch
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.model.continuity import POWER_TOLERANCE, Continuity
from tomr_power_model.model.input_health import InputState
from tomr_power_model.model.ticks import Arrival

IMU = "imu/data"


class InertialWatch:
    """Gyro and accelerometer of one IMU."""

    def __init__(self, period_ns: int, lately: int) -> None:
        """`period_ns` of the ticks; `lately`: so many of them in which a change counts."""
        self._gyro = GyroWatch(period_ns, lately)
        self._accelerometer = AccelerometerWatch(period_ns, lately)
        self._flow = Continuity(POWER_TOLERANCE)

    def leap(self) -> None:
        """Forget all samples where the stamps leap."""
        self._gyro.clear()
        self._accelerometer.clear()
        self._flow.leap()

    def add(self, stamp_ns: int, yaw_rate: float, force: Force) -> None:
        """Take a yaw rate [rad/s] and a specific force [m/s^2], NaN for what is not measured."""
        if not yaw_rate and not any(force):  # a bus that answers with zeros
            self._flow.refuse("nothing but zeros")
            return
        self._flow.take(stamp_ns)
        self._gyro.add(stamp_ns, yaw_rate)
        self._accelerometer.add(stamp_ns, force)

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
        yaw = self._gyro.residual(tick_ns, float(twist[2]), bands, moves=moves)
        along = self._accelerometer.residuals(tick_ns, twist, bands, is_well=is_well)
        return yaw, along

    def states(self, tick_ns: int, frame: ResidualFrame) -> list[InputState]:
        """What is to be said of the stream at a tick, if there was one: a robot need not have an
        IMU."""
        repeats = IMU_REPEATS in (frame.yaw.missing, frame.along[0].missing)
        ailment = IMU_REPEATS.removeprefix(f"{IMU} ") if repeats else ""
        was_heard = self._flow.last(tick_ns) or self._flow.ahead
        return [InputState(IMU, self._flow, ailment)] if was_heard else []
