"""Sensors that repeat one reading bit for bit while their motor works, or their robot moves.

How many repeats in a row are too many depends on the sensor: a noisy one hardly ever repeats
itself, a coarse one does all the time at a steady speed. So the share of repeats is learned while
the wheel turns, and a run counts that has become less likely than one in a billion. Of a coarse
sensor the model must ask for another reading besides, and the wheel turn as it should: a driver
without its signal draws the same standby power all the time. Of an IMU, which has to be noisy, the
wheels must ask for another reading: a simulated one may have no noise.
"""

import math
from collections import deque
from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.model.ticks import to_ns

Reading = tuple[float, ...]

_IMPROBABLE = math.log(1e9)
_NOISY = 0.2  # share of repeats of sensors that are not coarse
_LASTS = to_ns(0.4)  # of a coarse sensor's run
_PRIOR = 20.0  # samples before any was seen
_MEMORY = 800.0  # samples, before older ones count half
_SETTLES = to_ns(0.15)
_KEPT = 4096  # samples, should no tick come


@frozen
class Work:
    """What a motor does at a tick."""

    turns: bool  # the wheel is commanded to, or does
    follows: bool  # and as it should, as far as can be seen
    power: float  # that the model expects [W or A], NaN where it is not known
    band: float  # of that


class RepeatWatch:
    """Follows the readings of one sensor."""

    def __init__(self, share: float = 0.9, *, is_inertial: bool = False) -> None:
        """`share` of repeats that is expected before any reading was seen; one that is inertial
        shows its noise at rest as well."""
        self._expected, self._is_inertial = share, is_inertial
        self.clear()

    def clear(self) -> None:
        """Forget the sensor."""
        self._ahead: deque[tuple[int, Reading]] = deque(maxlen=_KEPT)
        self._repeats, self._samples = _PRIOR * self._expected, _PRIOR
        self._last: Reading | None = None
        self._begin_run(0)

    def _begin_run(self, stamp_ns: int) -> None:
        self._run, self._since = 0, stamp_ns
        self._least: list[float] = []
        self._most: list[float] = []
        self._strays = False

    def take(self, stamp_ns: int, reading: Reading) -> None:
        """Take a reading newer than those before."""
        self._ahead.append((stamp_ns, reading))

    def is_frozen(self, tick_ns: int, work: Work) -> bool:
        """Whether the readings up to a tick are one and the same for too long."""
        if self._catch_up(tick_ns, turns=work.turns):
            self._expect([work.power])
            self._strays = self._strays or not work.follows
        return self._is_improbable() and (
            self._share <= _NOISY
            or (tick_ns - self._since >= _LASTS and self._spread > work.band and not self._strays)
        )

    def is_stuck(self, tick_ns: int, shown: Sequence[float], *, moves: bool) -> bool:
        """Whether a noisy sensor of the robot's motion repeats itself for too long while what
        wheels show of that changed by more than one in any of its units, NaN where not known."""
        # What wheels show is the mean of a while, and goes on changing a little longer.
        if self._catch_up(tick_ns, turns=moves) and tick_ns - self._since > _SETTLES:
            self._expect(shown)
        return self._is_improbable() and self._share <= _NOISY and self._spread > 1.0

    def _catch_up(self, tick_ns: int, *, turns: bool) -> bool:
        """Follow the readings up to a tick; returns whether they repeat one before."""
        while self._ahead and self._ahead[0][0] <= tick_ns:
            self._follow(*self._ahead.popleft(), turns=turns)
        return turns and self._run > 0

    def _expect(self, values: Sequence[float]) -> None:
        """Of another reading; NaN says nothing."""
        if not self._least:
            self._least, self._most = [math.inf] * len(values), [-math.inf] * len(values)
        self._least = [min(least, value) for least, value in zip(self._least, values, strict=True)]
        self._most = [max(most, value) for most, value in zip(self._most, values, strict=True)]

    @property
    def _spread(self) -> float:
        """By how much another reading should have come, at most."""
        pairs = zip(self._least, self._most, strict=True)
        return max((most - least for least, most in pairs), default=0.0)

    @property
    def _share(self) -> float:
        return self._repeats / self._samples

    def _is_improbable(self) -> bool:
        return -self._run * math.log(self._share) > _IMPROBABLE

    def _follow(self, stamp: int, reading: Reading, turns: bool) -> None:
        if reading == self._last:
            self._run += turns
            return
        if not self._is_improbable():
            self._repeats += self._run
            self._samples += self._run + (turns or self._is_inertial)
        if self._samples > _MEMORY:
            self._repeats, self._samples = 0.5 * self._repeats, 0.5 * self._samples
        self._last = reading
        self._begin_run(stamp)
