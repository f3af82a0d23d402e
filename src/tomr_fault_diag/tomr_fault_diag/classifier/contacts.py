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

_MORE = 1.0  # N/kg: as much as somebody who leans on the robot
_ALONE = 0.4  # of the largest force that another wheel may bear
_LONGER = to_ns(0.2)  # than a shove takes


@frozen
class Contacts:
    """How likely a wheel slides (NaN: not known), and the wheel 0..2 that alone bears more, and for
    longer, than any push from outside."""

    slides: float = math.nan
    lone: int | None = None


NOTHING = Contacts()  # is known


class LoneWheelWatch:
    """Follows what each wheel bears beyond what its encoder explains, tick by tick."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._wheel: int | None = None
        self._since = 0  # ns

    def take(self, tick: Tick) -> int | None:
        """The wheel that has long borne a force alone."""
        wheel = _alone(tick)
        if wheel is None or wheel != self._wheel:
            self._wheel, self._since = wheel, tick.stamp_ns
        return wheel if tick.stamp_ns - self._since >= _LONGER else None


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
