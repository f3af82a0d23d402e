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

from tomr_fault_diag.residuals.frame import Residual
from tomr_power_model.model.ticks import NEVER, to_ns

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@frozen
class OthersSettings:
    """When commands count as another's. A band is what the power of a healthy motor beside its
    encoder leaves open."""

    wheels: int = 2  # that turn far otherwise than asked
    fits: float = 1.0  # band, within which power goes with the encoders, ...
    works: float = 1.0  # ... and by which such a wheel's motor draws otherwise than an idle one
    lately: int = to_ns(0.7)  # within which one was seen to
    pauses: int = to_ns(0.15)  # that say nothing: where a wheel turns as asked by chance
    lasts: int = to_ns(1.0)


class OthersWatch:
    """Looks at one tick after the other."""

    def __init__(self, settings: OthersSettings | None = None) -> None:
        self.settings = settings or OthersSettings()
        self.clear()

    def clear(self) -> None:
        """Forget what was seen."""
        # When a motor was last seen to work, since when others are obeyed, and until when [ns].
        self._worked = self._since = self._held = NEVER

    def take(self, now: int, astray: Flags, beyond: Array, derived: Sequence[Residual]) -> bool:
        """Whether a tick [ns] and those before show that others are obeyed.

        `astray`: wheels that turn far otherwise than asked; `beyond`: what their motors draw beyond
        an idle one's, (3,) each; `derived`: of the power beside the encoders', in the same unit.
        """
        s = self.settings
        bands = np.array([item.band for item in derived])
        off = np.array([item.residual for item in derived])
        fits = bool((np.abs(off) < s.fits * bands).all())  # false where anything is NaN
        if fits and (astray & (np.abs(beyond) > s.works * bands)).any():
            self._worked = now
        is_seen = self._worked >= now - s.lately
        if np.isnan(off + beyond).any():
            self._since = NEVER  # of what is missing nothing is concluded
        elif fits and is_seen and np.count_nonzero(astray) >= s.wheels:
            self._since = now if self._since == NEVER else self._since
            self._held = now
        elif now - self._held > s.pauses:
            self._since = NEVER
        return self._since != NEVER and now - self._since >= s.lasts
