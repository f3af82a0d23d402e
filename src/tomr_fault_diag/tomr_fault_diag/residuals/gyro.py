"""The yaw rate that a gyro measures beside that of the wheels: where they differ, wheels slide or
encoders are wrong.

A gyro that is mounted otherwise, or belongs to another robot, differs always. So one is believed
only once it has agreed with the wheels while the robot turned for a while. One that repeats itself
is dead.
"""

from collections import deque

from attrs import evolve

from tomr_fault_diag.residuals.frame import (
    IMU_REPEATS,
    NO_ENCODERS,
    NO_IMU,
    NOT_BELIEVED,
    UNKNOWN_YAW,
    Residual,
    rounded,
)
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.model.repeats import RepeatWatch
from tomr_power_model.model.ticks import to_ns

_TURNS = 0.2  # rad/s: slower turning says nothing of how a gyro is mounted
_AGREED = to_ns(2.0)  # of turning, tick after tick, in which it has to agree
_STRAYS = 0.5  # bands: a gyro that repeats itself while the wheels' rate changes more is dead
_KEPT = 1024  # samples, should no tick come


class GyroWatch:
    """Samples of the last moments, and whether the gyro is believed."""

    def __init__(self, period_ns: int, lately: int) -> None:
        """`period_ns` of the ticks; `lately`: so many of them in which a change counts."""
        self._period = period_ns
        self._window = max(period_ns, to_ns(0.05))
        self._samples: deque[tuple[int, float]] = deque(maxlen=_KEPT)
        self._recent: deque[float] = deque(maxlen=lately)
        self._repeats = RepeatWatch(is_inertial=True)
        self._agreed = 0  # ns
        self.clear()

    def clear(self) -> None:
        """Forget all samples; whether it is believed stays: it is the same gyro."""
        self._samples.clear()
        self._recent.clear()
        self._repeats.clear()

    @property
    def is_believed(self) -> bool:
        """Whether it has agreed with the wheels for long enough."""
        return self._agreed >= _AGREED

    def add(self, stamp_ns: int, yaw_rate: float) -> None:
        """Take a sample newer than those before [rad/s]."""
        self._samples.append((stamp_ns, yaw_rate))
        self._repeats.take(stamp_ns, (yaw_rate,))

    def rate(self, tick_ns: int) -> float:
        """Mean yaw rate of the window that ends at a tick [rad/s]; NaN without a sample in it."""
        samples, begin = self._samples, tick_ns - self._window
        while samples and samples[0][0] <= begin:
            samples.popleft()
        found = [rate for stamp, rate in samples if stamp <= tick_ns]
        return sum(found) / len(found) if found else float("nan")

    def residual(
        self, tick_ns: int, wheels: float, bands: BandSettings, *, moves: bool
    ) -> Residual:
        """What it measures at a tick less what the wheels show [rad/s], NaN where that is
        unknown, or the gyro is not believed; `moves`: whether wheels turn."""
        least, relative, transient = bands.of_yaw
        band = max(least, relative * abs(wheels)) + transient * self.spread(wheels)
        if self._repeats.is_stuck(tick_ns, [wheels / (_STRAYS * bands.yaw)], moves=moves):
            return evolve(UNKNOWN_YAW, missing=IMU_REPEATS)
        measured = self.rate(tick_ns)
        residual = measured - wheels
        self.compare(wheels, residual, band)
        if residual != residual:
            return evolve(UNKNOWN_YAW, missing=NO_IMU if measured != measured else NO_ENCODERS)
        if not self.is_believed:
            return evolve(UNKNOWN_YAW, missing=NOT_BELIEVED)
        return Residual(rounded(residual), rounded(band), rounded(wheels), "rad/s")

    def spread(self, wheels: float) -> float:
        """How far the yaw rate that the wheels show [rad/s] moved lately, the newest included."""
        if wheels != wheels:  # NaN
            return 0.0
        self._recent.append(wheels)
        return max(self._recent) - min(self._recent)

    def compare(self, wheels: float, residual: float, band: float) -> None:
        """Take note of how a tick's yaw rates [rad/s] agree."""
        if self.is_believed or residual != residual:
            return
        if abs(residual) > band:
            self._agreed = 0
        elif abs(wheels) > _TURNS:
            self._agreed += self._period
