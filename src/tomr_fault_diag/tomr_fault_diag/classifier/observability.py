"""Which faults the present motion could not show, whoever looked.

A motor that need not turn draws standby power with and without its control signal or encoder; a
wheel slips only while it has to push. Told from what the command asks for and the encoders say.
"""

from collections import deque

from attrs import frozen

from tomr_fault_diag.residuals.frame import SPEEDS, Residual, ResidualFrame

_TURNING = 0.5  # rad/s: a slower wheel counts as idle
_SPEEDING = 0.3  # rad/s over the time below: what asks for traction
_TICKS = 10  # without it, before a fault counts as not observable
_WHEELS = 3


@frozen
class Unseen:
    """Faults that could not be seen lately: of the motor or driver of a wheel (0..2), and slip."""

    wheels: tuple[int, ...] = ()
    slip: bool = False

    @property
    def everything(self) -> bool:
        """Whether no fault at all could be seen: the robot stands still."""
        return len(self.wheels) == _WHEELS and self.slip

    @property
    def words(self) -> tuple[str, ...]:
        """What could not be seen, in words."""
        motors = tuple(f"motor {wheel + 1}" for wheel in self.wheels)
        return (*motors, "slip") if self.slip else motors


class MotionWatch:
    """Remembers the wheels' motion of the last half second; plain floats, three are few."""

    def __init__(self) -> None:
        self._expected: deque[tuple[float, ...]] = deque(maxlen=_TICKS)
        self._turning: deque[tuple[bool, ...]] = deque(maxlen=_TICKS)

    def clear(self) -> None:
        """Forget the motion."""
        self._expected.clear()
        self._turning.clear()

    def take(self, frame: ResidualFrame) -> Unseen:
        """Take the newest tick; returns what the last ticks could not show."""
        speeds = [frame.residuals[index] for index in SPEEDS]
        self._expected.append(tuple([speed.modelled for speed in speeds]))
        self._turning.append(tuple([_turns(speed) for speed in speeds]))
        if len(self._expected) < _TICKS:
            return Unseen()
        turning = [any(wheel) for wheel in zip(*self._turning, strict=True)]
        steady = all(
            max(wheel) - min(wheel) < _SPEEDING for wheel in zip(*self._expected, strict=True)
        )
        return Unseen(tuple([wheel for wheel, turns in enumerate(turning) if not turns]), steady)


def _turns(speed: Residual) -> bool:
    """Whether a wheel is told to turn, or turns; one that is not known may."""
    expected = speed.modelled
    measured = expected + (-speed.residual if expected < 0.0 else speed.residual)
    return not (abs(expected) < _TURNING and abs(measured) < _TURNING)
