"""What each driver's voltage is beyond the simulated driver's, by the law that both obey.

    v - v_sim = k_p (omega_sim - omega) + k_i (theta_sim - theta + offset)

for both are asked for the same, and sum up their errors. The motion alone shows it, whatever
friction there is. The offset is what the two sums differed by at the beginning, which a push may
have left: it fades in the first two seconds of motion. Jitter of the commands adds to it later, so
it goes on to fade while the wheel turns, slowly: what stays in the voltage shows for minutes. A
driver gives no more than its supply, and then does not sum up.

Real drivers take up a command when their period begins, up to half a period before or after the
simulated ones do. A wheel at omega is ahead by omega times that, all three alike: the middle one of
the three delays that the last half minute shows is no difference of voltages.
"""

import math
from collections.abc import Sequence

from tomr_power_model.robot import WHEELS, Robot

_UNKNOWN = float("nan")
_MOVING = 1.0  # rad/s
_FADES = 0.03  # 1/s, of the difference in motion, ...
_FADES_FIRST, _FIRST = 2.1, 2.0  # ... and in its first so many seconds
_LIKE = 0.5  # rad/s, by which a wheel turns as simulated
_MEMORY = 30.0  # s, over which the delay of the drivers is estimated
_LITTLE = 90.0  # (rad/s)^2: half a second at 3 rad/s, before which there is taken to be none


class DriverLaw:
    """Follows the drivers tick by tick."""

    def __init__(self, robot: Robot, period_s: float) -> None:
        """Of a robot, in ticks so long."""
        self._proportional = robot.controller.proportional
        self._integral = robot.controller.integral
        self._most = robot.supply.nominal_voltage
        self._later, self._first = (
            -math.expm1(-rate * period_s) for rate in (_FADES, _FADES_FIRST)
        )
        self._lasts = round(_FIRST / period_s)
        self._forgets = math.exp(-period_s / _MEMORY)
        self._longest = 1.0 / robot.controller.rate
        self.clear()

    def clear(self) -> None:
        """Nothing is known of the drivers until the next command."""
        self._squares = [0.0] * WHEELS  # of the speeds [(rad/s)^2] ...
        self._products = [0.0] * WHEELS  # ... and with the angles that wheels are ahead
        self.forget()

    def forget(self) -> None:
        """They were asked for what is not known: what their sums differ by means nothing."""
        self._offset = [_UNKNOWN] * WHEELS  # rad
        self._before = [_UNKNOWN] * WHEELS  # what the sums differed by at the end of the last tick
        self._begins = [self._lasts] * WHEELS  # ticks of motion in which an offset fades soon

    def beyond(
        self,
        ahead: Sequence[float],
        speed: Sequence[float],
        simulated: Sequence[float],
        *,
        expected: Sequence[float],
        share: float,
    ) -> list[float]:
        """Of each driver [V], NaN where not known.

        Args:
            ahead: by how much a simulated wheel has turned further at the end of a tick [rad].
            speed: of the wheels, mean of the tick [rad/s].
            simulated: the same as simulated.
            expected: voltages of the simulated drivers then [V].
            share: of the tick at the time that is asked about.
        """
        found = []
        delay = self._delay()
        for wheel in range(WHEELS):
            slower = simulated[wheel] - speed[wheel]
            if self._offset[wheel] != self._offset[wheel]:
                self._offset[wheel] = -ahead[wheel]
            if abs(speed[wheel]) > _MOVING:
                fades = self._first if self._begins[wheel] else self._later
                self._begins[wheel] = max(self._begins[wheel] - 1, 0)
                self._offset[wheel] -= fades * (ahead[wheel] + self._offset[wheel])
            apart = self._limited(
                wheel, ahead[wheel], expected[wheel] + self._proportional * slower
            )
            before = self._before[wheel] if self._before[wheel] == self._before[wheel] else apart
            self._before[wheel] = apart
            more = before + share * (apart - before) - delay * simulated[wheel]
            found.append(self._proportional * slower + self._integral * more)
            if abs(slower) < _LIKE and apart == apart:
                self._learn(wheel, simulated[wheel], apart)
        return found

    def _limited(self, wheel: int, ahead: float, volts: float) -> float:
        """By how much a driver's sum is ahead [rad], that gives so much [V] without that."""
        apart = ahead + self._offset[wheel]
        over = abs(volts + self._integral * apart) - self._most
        if over > 0.0 and self._integral:
            less = math.copysign(min(over / self._integral, abs(apart)), apart)
            self._offset[wheel] -= less
            apart -= less
        return apart

    def _learn(self, wheel: int, speed: float, apart: float) -> None:
        """How far a wheel is ahead at a speed [rad, rad/s]."""
        self._squares[wheel] = self._forgets * self._squares[wheel] + speed * speed
        self._products[wheel] = self._forgets * self._products[wheel] + speed * apart

    def _delay(self) -> float:
        """Of the drivers after the simulated ones [s]."""
        pairs = zip(self._products, self._squares, strict=True)
        middle = sorted(product / (square + _LITTLE) for product, square in pairs)[WHEELS // 2]
        return min(max(middle, -self._longest), self._longest)

    def taken_over(self, angles: Sequence[float]) -> None:
        """The simulated drivers have added so much to their sums [rad]."""
        for wheel, angle in enumerate(angles):
            self._offset[wheel] -= angle
            self._before[wheel] -= angle
