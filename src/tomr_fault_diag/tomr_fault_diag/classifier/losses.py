"""Which loss explains a parity that breaks: of a motor's signal, or of its encoder's counts.

Without its signal a wheel turns as its encoder shows, and motors draw what that takes. Without its
counts the motor has the voltage v that its driver gives: it draws its current at that, and turns
with what its winding leaves,

    i = (P - P_idle) / v,   omega = (v - R i) / k.

Either way the body moves as three wheels turn, and what that takes of every motor on a level floor
is known. Where one of the two explains all three and the other does not, as the ticks of half a
second say it in the mean, it is that one.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import MOVES, Tick
from tomr_fault_diag.residuals.frame import BAND_SIGMAS, ENCODERS, ResidualFrame
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.slides.body import body_of, rolling_forces

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_SLOPE = 1e-3  # W/A


@frozen
class LossSettings:
    """When one of the two explains what motors draw, and the other does not."""

    memory: int = to_ns(0.5)  # over which log-likelihood ratios are averaged
    clear: float = 2.0  # mean of a tick, at least
    explains: float = 12.0  # sum of the squares of three motors [sigma^2], at most
    counted: float = 25.0  # of one motor [sigma^2], at most
    least: float = 1.0  # V, of a driver that says how its motor turns


def nowhere() -> Flags:
    """No wheel, (3,)."""
    return np.zeros(WHEELS, dtype=np.bool_)


@frozen(eq=False)
class Losses:
    """Of each motor, (3,): which alone explains that its parity breaks."""

    signal: Flags
    counts: Flags


UNEXPLAINED = Losses(nowhere(), nowhere())


class LossWatch:
    """Looks at one tick after the other."""

    def __init__(self, robot: Robot, motors: Motors, settings: LossSettings | None = None) -> None:
        self.settings = settings or LossSettings()
        self._motors = motors
        self._body, self._radius = body_of(robot)
        self._drag = robot.everywhere("contact.roller_drag", "coefficient")[0]
        self.clear()

    def clear(self) -> None:
        """Nothing was seen."""
        self._last: Tick | None = None
        self._turned = np.full(WHEELS, math.nan)  # rad/s, in the last tick, without their counts
        self._odds = np.zeros(WHEELS)  # log, of lost counts over a lost signal, mean of a tick

    def take(self, frame: ResidualFrame, breaks: Flags) -> Losses:
        """Of a tick, and of the motors whose parity breaks, (3,)."""
        tick = Tick.of(self._motors, frame, self._last) if breaks.any() else None
        if tick is None:
            self.clear()
            return UNEXPLAINED
        turning, odds = self._turning(tick, frame), np.zeros(WHEELS)
        elapsed = math.nan if self._last is None else float(tick.stamp_ns - self._last.stamp_ns)
        faster = (turning - self._turned) * (NANOSECONDS / elapsed)
        bands = np.array([frame.residuals[index].band for index in ENCODERS])
        sigma = self._motors.scale_of(frame.residuals[ENCODERS[0]].unit) * bands / BAND_SIGMAS
        shown = (self._beyond(tick.power, tick.speed, tick.change) / sigma) ** 2
        may_be = np.isfinite(faster) & (np.abs(turning) > np.abs(tick.speed))
        for wheel in np.flatnonzero(breaks & may_be).tolist():
            speed, change = tick.speed.copy(), tick.change.copy()
            speed[wheel], change[wheel] = turning[wheel], faster[wheel]
            turned = (self._beyond(tick.power, speed, change) / sigma) ** 2
            odds[wheel] = self._log_odds(shown, turned)
        new = min(elapsed / self.settings.memory, 1.0) if self._last else 0.0
        self._odds = np.where(breaks, (1.0 - new) * self._odds + new * odds, 0.0)
        if (np.abs(tick.expected) < MOVES).all():
            # Drivers may let go of a robot that is to stand: none draws, whatever their laws say.
            self._odds = np.maximum(self._odds, 0.0)
        self._last, self._turned = tick, turning
        return Losses(self._odds < -self.settings.clear, self._odds > self.settings.clear)

    def _turning(self, tick: Tick, frame: ResidualFrame) -> Array:
        """How wheels turn whose motors have what their drivers give [rad/s], (3,)."""
        motors, drawn = self._motors, tick.power
        volts = np.array([item.modelled + item.residual for item in frame.voltages])
        if math.isfinite(frame.supply):
            volts *= min(frame.supply, 1.0)
        volts[np.abs(volts) < self.settings.least] = math.nan
        current = (drawn - motors.idle) / volts
        if motors.reports_currents:
            current = drawn if motors.reports_signs else np.copysign(drawn, volts)
        return np.asarray((volts - motors.resistance * current) / motors.constant)

    def _log_odds(self, squares: Array, others: Array) -> float:
        """Of what leaves the others over what leaves the squares; 0 where neither explains all."""
        s = self.settings
        if not min(squares.sum(), others.sum()) < s.explains:
            return 0.0
        counted = [np.minimum(item, s.counted).sum() for item in (squares, others)]
        return float(np.nan_to_num(0.5 * (counted[0] - counted[1])))

    def _beyond(self, drawn: Array, speed: Array, change: Array) -> Array:
        """What motors draw [W], or [A], beyond what the body takes that moves so, (3,)."""
        motors, body = self._motors, self._body
        twist, faster = (body.to_twist @ (self._radius * part) for part in (speed, change))
        forces = rolling_forces(body, self._drag, twist, faster)
        forces -= motors.forces(np.zeros(WHEELS), speed, change)
        needed = forces * self._radius / motors.constant
        currents = motors.either_current(drawn, speed)
        nearer = np.argmin(np.abs(currents - needed[:, None]), axis=1)
        current = currents[range(WHEELS), nearer]
        slope = np.maximum(np.abs(motors.per_current(speed, current)), _LEAST_SLOPE)
        return np.asarray((current - needed) * slope)
