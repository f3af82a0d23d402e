"""A robot that obeys commands which are not those that are known.

A joystick that is wired to the base, a second publisher, a base that takes back what it is asked
for: the wheels turn otherwise than commanded, and each motor draws what its wheel's motion takes.
A fault of one wheel does not look so: its motor's power does not go with what its encoder shows, or
the other wheels do as they are asked.
"""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, ResidualFrame
from tomr_power_model.model.ticks import NEVER, to_ns


@frozen
class OthersSettings:
    """When commands count as another's. A band is what the residual of a healthy robot leaves
    open."""

    far: float = 3.0  # bands, by which a speed is off
    fits: float = 1.0  # band, within which power goes with the encoders
    works: float = 1.0  # bands of that, by which a motor draws otherwise than one that is idle, ...
    seen: int = 1  # ... of so many wheels, of ...
    wheels: int = 2  # ... so many that are far off
    lately: int = to_ns(0.7)  # within which a motor was seen to work
    pauses: int = to_ns(0.15)  # that say nothing: where a wheel turns as asked by chance
    lasts: int = to_ns(0.5)


class OthersWatch:
    """Looks at one tick after the other."""

    def __init__(self, idle: Sequence[float], settings: OthersSettings | None = None) -> None:
        """`idle`: what each motor draws that is not driven, in the unit of its residual."""
        self._idle = np.array(idle)
        self.settings = settings or OthersSettings()
        self.clear()

    def clear(self) -> None:
        """Forget what was seen."""
        self._worked = np.full(len(self._idle), NEVER)  # ns, when each was last seen to
        self._since, self._held = NEVER, NEVER  # ns

    def take(self, frame: ResidualFrame) -> bool:
        """Whether the newest tick and those before show that others are obeyed."""
        now, s = frame.stamp_ns, self.settings
        speeds, bands, _ = _of(frame, SPEEDS)
        is_far = np.abs(speeds) > s.far * bands  # false where either is NaN
        off, widths, _ = _of(frame, ENCODERS)
        drawn = np.sum(_of(frame, MOTORS)[::2], axis=0)
        fits = bool((np.abs(off) < s.fits * widths).all())
        works = is_far & (np.abs(drawn - self._idle) > s.works * widths)
        self._worked[works & fits] = now
        seen = np.count_nonzero(self._worked >= now - s.lately)
        if fits and np.count_nonzero(is_far) >= s.wheels and seen >= s.seen:
            self._since = now if self._since == NEVER else self._since
            self._held = now
        elif now - self._held > s.pauses:
            self._since = NEVER
        return self._since != NEVER and now - self._since >= s.lasts


def _of(frame: ResidualFrame, channels: Sequence[int]) -> NDArray[np.float64]:
    """Residuals, bands and what is modelled, (3, n)."""
    rows = [frame.residuals[index] for index in channels]
    return np.array([[row.residual, row.band, row.modelled] for row in rows]).T
