"""Which faults the present motion could not show, whoever looked.

A motor that need not turn draws standby power with and without its control signal or encoder; a
wheel slips only while it has to push. Decided from what the command asks for and the encoders say.
"""

from collections import deque
from collections.abc import Iterable

from attrs import frozen

from tomr_fault_diag.residuals.frame import SPEEDS, Residual, ResidualFrame, measured_speed
from tomr_power_model.model.ticks import to_ns

_TURNING = 0.5  # rad/s: a slower wheel counts as idle
_STILL = 0.1  # rad/s: a slower wheel stands
_SPEEDING = 0.3  # rad/s over the time below: what asks for traction
_LATELY = to_ns(0.5)  # without it, before a fault counts as not observable
_LEAST = to_ns(0.45)  # of the motion that must be known: ten ticks of 50 ms
_WHEELS = 3


@frozen
class Unseen:
    """Faults that could not be seen lately: of the motor or driver of a wheel (0..2), and slip."""

    wheels: tuple[int, ...] = ()
    slip: bool = False
    moved: tuple[int, ...] = ()  # wheels that stood, and turned lately though nothing asked them to
    driven: bool = False  # some wheel was asked to turn lately
    blind: tuple[tuple[int, str], ...] = ()  # wheels without power of their own, and why

    @property
    def everything(self) -> bool:
        """Whether no fault at all could be seen: the robot stands still."""
        return len(self.wheels) == _WHEELS and self.slip

    @property
    def words(self) -> tuple[str, ...]:
        """What could not be seen, in words."""
        reasons = {wheel: f" ({reason})" if reason else "" for wheel, reason in self.blind}
        hidden = sorted({*self.wheels, *reasons})
        motors = tuple(f"motor {wheel + 1}{reasons.get(wheel, '')}" for wheel in hidden)
        return (*motors, "slip") if self.slip else motors


# Stamp [ns], speeds expected [rad/s], which wheels are commanded to turn, which may turn, and which
# turn that have stood since.
_Flags = tuple[bool, ...]
_Tick = tuple[int, tuple[float, ...], _Flags, _Flags, _Flags]


class MotionWatch:
    """Remembers the wheels' motion of the last half second; plain floats, three are few."""

    def __init__(self) -> None:
        self._ticks: deque[_Tick] = deque()
        self.clear()

    def clear(self) -> None:
        """Forget the motion."""
        self._ticks.clear()
        self._since: int | None = None  # ns
        self._stood = [True] * _WHEELS  # since they were last asked to turn, or ever

    def take(self, frame: ResidualFrame) -> Unseen:
        """Take the newest tick; returns what the last ticks could not show."""
        speeds = [frame.residuals[index] for index in SPEEDS]
        expected = tuple([speed.modelled for speed in speeds])
        now, asked = frame.stamp_ns, tuple([_is_asked_to_turn(speed) for speed in speeds])
        may_turn = tuple([_may_turn(speed) for speed in speeds])
        # One that goes on as it was asked to, as without its signal, is moved by nobody.
        turns = _turns if any(asked) else _stirs
        moves = tuple(
            [stood and turns(speed) for stood, speed in zip(self._stood, speeds, strict=True)]
        )
        self._stood = [
            not on and (stood or _stands(speed))
            for on, stood, speed in zip(asked, self._stood, speeds, strict=True)
        ]
        self._ticks.append((now, expected, asked, may_turn, moves))
        while self._ticks[0][0] <= now - _LATELY:
            self._ticks.popleft()
        if self._since is None:
            self._since = now
        if now - self._since < _LEAST:
            return Unseen()
        _, every_expected, *flags = zip(*self._ticks, strict=True)
        asked, may_turn, moves = map(_ever, flags)
        steady = all(
            max(wheel) - min(wheel) < _SPEEDING for wheel in zip(*every_expected, strict=True)
        )
        idle = [wheel for wheel in range(_WHEELS) if not asked[wheel]]
        return Unseen(
            wheels=tuple([wheel for wheel in idle if not may_turn[wheel]]),
            slip=steady,
            moved=tuple([wheel for wheel in idle if moves[wheel]]),
            driven=len(idle) < _WHEELS,
        )


def _ever(ticks: Iterable[Iterable[bool]]) -> tuple[bool, ...]:
    """Of each wheel, whether something held in any tick."""
    return tuple([any(wheel) for wheel in zip(*ticks, strict=True)])


def _is_asked_to_turn(speed: Residual) -> bool:
    """One of which it is not known may be."""
    return not abs(speed.modelled) < _TURNING


def _may_turn(speed: Residual) -> bool:
    """One that is not known may."""
    return not abs(measured_speed(speed)) < _TURNING


def _turns(speed: Residual) -> bool:
    """Of one that is not known, nobody can say so."""
    return abs(measured_speed(speed)) >= _TURNING


def _stirs(speed: Residual) -> bool:
    """Of a robot that is to stand: beyond what a healthy one's encoders show as well."""
    is_still = abs(speed.modelled) < _STILL
    beyond = abs(speed.residual) > speed.band and not _stands(speed)
    return _turns(speed) or (is_still and beyond)


def _stands(speed: Residual) -> bool:
    return abs(measured_speed(speed)) < _STILL
