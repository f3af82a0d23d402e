"""What each driver's voltage is beyond the simulated driver's, by the law that both obey.

    v - v_sim = k_p (omega_sim - omega) + k_i (theta_sim - theta + offset)

for both are asked for the same, and sum up their errors. The motion alone shows it, whatever
friction there is. The offset is what the two sums differed by at the beginning, which a push may
have left: it fades until the wheel has turned as simulated for two seconds on end, but not while
it turns otherwise, for then the sums do differ. More than friction held the wheel against no push
has left: what differs beyond that is a load, as of a slope, and stays. Jitter of the commands adds
to it later, so it goes on to fade while the wheel turns, slowly: what stays in the voltage shows
for minutes. A driver gives no more than its supply, and then does not sum up.

Real drivers take up a command when their period begins, up to half a period before or after the
simulated ones do. A wheel that turns faster by omega is ahead by omega times that, all three alike:
the middle one of the three delays that the last half minute shows is no difference of voltages.
Faster than in the motion in which the offset faded, for that is part of the offset. A load puts
wheels ahead as well, by more than any such delay: what may be no delay says nothing of it.
"""

import math
from collections.abc import Sequence

from tomr_power_model.model.offsets import UNKNOWN, Offsets, between
from tomr_power_model.robot import WHEELS, Robot

_MOVING = 1.0  # rad/s
FADES = 0.03  # 1/s, of the difference in motion, ...
_FADES_FIRST, _FIRST = 2.1, 2.0  # ... and until, so many seconds on end, ...
_MORE = 1.3  # times what friction could hold, for no description has it right
_ALIKE = 0.2  # ... the wheel has turned as simulated [rad/s]
_LIKE = 0.5  # rad/s, by which a wheel turns as simulated
_MEMORY = 30.0  # s, over which the delay of the drivers is estimated
_LONGEST = 0.7  # of a driver's period, of a delay: half of it, and clocks that are a little off
_LITTLE = 90.0  # (rad/s)^2: half a second at 3 rad/s, before which there is taken to be none


class DriverLaw:
    """Follows the drivers tick by tick."""

    def __init__(self, robot: Robot, period_s: float) -> None:
        """Of a robot, in ticks so long."""
        self._proportional = robot.controller.proportional
        self._integral = robot.controller.integral
        self._most = robot.supply.nominal_voltage
        self._later, self._first = (-math.expm1(-rate * period_s) for rate in (FADES, _FADES_FIRST))
        self._lasts = round(_FIRST / period_s)
        self._forgets = math.exp(-period_s / _MEMORY)
        self._longest = _LONGEST / robot.controller.rate
        self.clear()

    def clear(self) -> None:
        """Nothing is known of the drivers until the next command."""
        self._squares = [0.0] * WHEELS  # of the speeds [(rad/s)^2] ...
        self._products = [0.0] * WHEELS  # ... and with the angles that wheels are ahead
        self.forget()

    def forget(self) -> None:
        """They were asked for what is not known: what their sums differ by means nothing."""
        self._offsets = Offsets()
        self._sums = [UNKNOWN] * WHEELS  # that drivers have summed up, as far as is known [rad]
        self._before = [UNKNOWN] * WHEELS  # what the sums differed by at the end of the last tick
        self._usual = [UNKNOWN] * WHEELS  # speeds that the offsets stand for [rad/s]
        self._begins = [self._lasts] * WHEELS  # ticks of motion in which an offset fades soon ...
        self._may_fade = [math.inf] * WHEELS  # ... and so much of it may [rad]

    def beyond(
        self,
        ahead: Sequence[float],
        speed: Sequence[float],
        simulated: Sequence[float],
        *,
        asked: Sequence[float],
        sums: Sequence[float],
        holds: Sequence[float],
        share: float,
    ) -> list[float]:
        """Of each driver [V], NaN where not known.

        Args:
            ahead: by how much a simulated wheel has turned further at the end of a tick [rad].
            speed: of the wheels, mean of the tick [rad/s].
            simulated: the same as simulated.
            asked: speeds that the drivers are asked for then [rad/s].
            sums: of the simulated drivers' errors then [rad].
            holds: what friction holds the wheels against while the robot stands [V].
            share: of the tick at the time that is asked about.
        """
        slower = [there - here for there, here in zip(simulated, speed, strict=True)]
        now = []
        for wheel in range(WHEELS):
            apart = UNKNOWN  # an angle that is lost for a moment leaves the offset as it is
            if ahead[wheel] == ahead[wheel]:
                apart = self._offsets.beyond(wheel, ahead[wheel], 0.0)
                fades = self._fades(wheel, speed[wheel], slower[wheel], abs(apart), holds[wheel])
                self._offsets.lower(wheel, fades * apart)
                apart -= fades * apart
                self._follow_usual(wheel, simulated[wheel], fades)
            volts = self._proportional * (asked[wheel] - speed[wheel])
            now.append(self._limited(wheel, sums[wheel] + apart, volts) - sums[wheel])
        delay, middle = self._delay(), between(self._before, now, share)
        faster = [turns - usual for turns, usual in zip(simulated, self._usual, strict=True)]
        for wheel, apart in enumerate(now):
            may_be_late = abs(apart) < self._longest * abs(faster[wheel])  # not where not known
            if may_be_late and abs(slower[wheel]) < _LIKE:
                self._learn(wheel, faster[wheel], apart)
        self._before = now
        return [
            self._proportional * less + self._integral * (apart - delay * more)
            for less, apart, more in zip(slower, middle, faster, strict=True)
        ]

    def _fades(self, wheel: int, speed: float, slower: float, apart: float, holds: float) -> float:
        """Share of an offset that a tick takes off, of a wheel that turns so, and so much slower
        than simulated [rad/s], whose sums are so far apart [rad], and that friction has held
        against so much [V]."""
        if not abs(speed) > _MOVING:
            return 0.0
        if not self._begins[wheel]:
            return self._later
        if abs(slower) > _ALIKE:
            self._begins[wheel] = self._lasts
            return self._later
        self._begins[wheel] -= 1
        return max(self._later, self._of_a_push(wheel, apart, holds))

    def _of_a_push(self, wheel: int, apart: float, holds: float) -> float:
        """The same of what a push may have left."""
        if not (apart and self._integral):
            return self._first
        most = min(self._may_fade[wheel], _MORE * holds / self._integral)
        fades = min(self._first * apart, most)
        self._may_fade[wheel] = most - fades
        return fades / apart

    def _follow_usual(self, wheel: int, simulated: float, fades: float) -> None:
        """Let the speed that an offset stands for fade as the offset does."""
        if self._usual[wheel] != self._usual[wheel]:
            self._usual[wheel] = simulated
        self._usual[wheel] += fades * (simulated - self._usual[wheel])

    def _limited(self, wheel: int, total: float, volts: float) -> float:
        """What a driver has summed up [rad], that gives so much for its error [V], and would have
        summed up so much [rad] without a limit: at its limit it does not sum up."""
        if total != total:
            return total
        found, wanted = total, volts + self._integral * total
        if abs(wanted) > self._most and self._integral:
            found = self._sums[wheel]
            if not abs(volts + self._integral * found) > self._most:  # so if it is not known
                found = (math.copysign(self._most, wanted) - volts) / self._integral
            self._offsets.lower(wheel, total - found)
        self._sums[wheel] = found
        return found

    def _learn(self, wheel: int, speed: float, apart: float) -> None:
        """How far a wheel is ahead that turns faster by so much [rad, rad/s]."""
        self._squares[wheel] = self._forgets * self._squares[wheel] + speed * speed
        self._products[wheel] = self._forgets * self._products[wheel] + speed * apart

    def _delay(self) -> float:
        """Of the drivers after the simulated ones [s]."""
        pairs = zip(self._products, self._squares, strict=True)
        return sorted(product / (square + _LITTLE) for product, square in pairs)[WHEELS // 2]

    def taken_over(self, angles: Sequence[float]) -> None:
        """The simulated drivers have added so much to their sums [rad]."""
        for wheel, angle in enumerate(angles):
            self._offsets.lower(wheel, angle)
            self._before[wheel] -= angle
