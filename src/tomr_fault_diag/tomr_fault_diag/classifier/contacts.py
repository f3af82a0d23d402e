"""What the forces of the wheels' contacts show of a robot: evidence beside the network's.

A push or a load moves the body, and the body shares it out among its wheels: of three, one wheel
bears it alone only where it acts along that very wheel, at the wheel. So a force that one wheel
bears alone, larger and longer than somebody pushes, comes from that wheel: its encoder does not
show how it turns, it is stuck, or it drags.
"""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.severity.tick import Tick
from tomr_power_model.model.ticks import to_ns

Array = NDArray[np.float64]

_GRIPS = 0.1  # likelihood of a slide
_MORE = 1.0  # N/kg: as much as somebody who leans on the robot
_ALONE = 0.4  # of the largest force that another wheel may bear
_LONGER = to_ns(0.2)  # than a shove takes
_ASKED = 1.0  # rad/s, of a wheel that should turn
_STILL = 0.05  # of that speed: what turns slower stands
_STOPPED = to_ns(0.05)  # a wheel that a push turns back stands for no two ticks


@frozen
class Contacts:
    """What is known of the contacts.

    `slides`: how likely a wheel does, NaN where that is not known; `lone`: the wheel 0..2 that
    alone bears more, and for longer, than any push from outside; `unmoved`: the one that alone
    bears more and shows no motion in two ticks; `force`: one on the body that stays, as on a slope,
    explains what all hand on; `slopes`: some such force does, which need not be known; `calm`: for
    long nothing has left its band that a slide would move; `felt`: an accelerometer says so as
    well, which feels no more than what contacts hand on.
    """

    slides: float = math.nan
    lone: int | None = None
    unmoved: int | None = None
    force: bool = False
    slopes: bool = False
    calm: bool = False
    felt: bool = False

    @property
    def hides_slopes(self) -> bool:
        """Whether something is known of them, and no accelerometer would feel a slope."""
        return not (math.isnan(self.slides) or self.felt)

    @property
    def grips(self) -> bool:
        """Whether no wheel slides, as far as is known."""
        return self.slides < _GRIPS  # nor where it is NaN


NOTHING = Contacts()  # is known


class LoneWheelWatch:
    """Follows what each wheel bears beyond what its encoder explains, tick by tick."""

    def __init__(self, quantum: float) -> None:
        """`quantum` of the speeds [rad/s]: less than it is not seen to turn."""
        self._quantum = quantum
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._wheel: int | None = None
        self._since = 0  # ns, when it began to bear a force alone ...
        self._unmoved_since: int | None = None  # ... and to stand, in all ticks since

    def take(self, tick: Tick, slides: float) -> Contacts:
        """Which wheels bear a force alone, beside how likely one slides."""
        wheel, now = _alone(tick), tick.stamp_ns
        if wheel is None or wheel != self._wheel:
            self._wheel, self._since, self._unmoved_since = wheel, now, None
        if wheel is None or not self._stands(tick, wheel):
            self._unmoved_since = None
        elif self._unmoved_since is None:
            self._unmoved_since = now
        stopped = self._unmoved_since is not None and now - self._unmoved_since >= _STOPPED
        is_lone = now - self._since >= _LONGER
        return Contacts(slides, wheel if is_lone else None, wheel if stopped else None)

    def _stands(self, tick: Tick, wheel: int) -> bool:
        """Whether a wheel shows no motion where it should turn plainly."""
        expected, speed = abs(float(tick.expected[wheel])), abs(float(tick.speed[wheel]))
        return expected > _ASKED and speed + self._quantum < _STILL * expected


def _alone(tick: Tick) -> int | None:
    motors = tick.motors
    measured, explained = (
        motors.forces(current, tick.speed, tick.change)
        for current in (tick.current, tick.expected_current)
    )
    beyond = np.abs(measured - explained) / motors.mass
    wheel = int(np.argmax(beyond))
    most = float(beyond[wheel])
    # False where anything is not a number.
    is_alone = most > _MORE and bool((np.delete(beyond, wheel) < _ALONE * most).all())
    return wheel if is_alone else None
