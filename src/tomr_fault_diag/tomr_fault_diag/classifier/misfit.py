"""What fits no state that a classifier knows: commands that are not followed, and far residuals.

The classifier weighs known states against each other, so something else can look like any of them.
These rules ask nothing but the residuals themselves.
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import frozen

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_fault_diag.classifier.others import OthersWatch
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    RESIDUALS,
    SPEEDS,
    TOTAL,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS

_TURNING = 0.5  # rad/s: a wheel that is expected to turn
_STANDING = 0.2  # of the expected speed: a slower wheel does not follow
_HALTING = 0.6  # of the expected speed: slower wheels are about to stand, if all are so ...
_ALIKE = 0.15  # ... but for so much
_BACK = 1.0  # of the expected speed: one that turns back faster does something else
_AT_LEAST = 2  # wheels that must be expected to turn: one alone may have a fault of its own
_IDLE = 0.5  # bands by which the power of a motor that is not driven may be off
_IGNORED_FOR = to_ns(0.3)
_FAR = 3.0  # bands
_FAR_FOR = to_ns(1.0)
_FAR_LONG = to_ns(2.5)  # by then the laws of what acts from outside have seen a slope's beginning
_LOW_FOR = to_ns(1.0)
_MORE = 0.02  # of the nominal voltage, by which it must rise to be no longer low
_GAP = to_ns(1.0)  # a longer silence says nothing of what lay in it


@frozen
class Misfit:
    """What a frame shows beside the classifier's states."""

    ignores_commands: bool = False  # for a moment already: wheels stand that should turn
    # And for long enough to be named; or it brakes unasked, or no motor has been driven for long.
    disobeys: bool = False
    obeys_others: bool = False  # than the commands that are known, as far as no fault explains it
    unexplained: bool = False  # some residual has been far out of its band for long
    stays_so: bool = False  # for so long that even a push or a slope is known by then
    low_supply: bool = False  # its voltage has been too low for long


class MisfitWatch:
    """Remembers since when [ns] nothing follows, the supply is low, and each residual lies far out
    of its band."""

    def __init__(self, idle: Sequence[float] = (), braking: BrakingWatch | None = None) -> None:
        """`idle`: what each motor draws that is not driven, in the unit of its residual; without
        `braking` a robot that ignores its commands is known once it stands."""
        self._idle = np.array(idle or [math.nan] * WHEELS)
        self._braking = braking
        self._others = OthersWatch()
        self.clear()

    def clear(self) -> None:
        """Forget what was seen."""
        if self._braking is not None:
            self._braking.clear()
        self._others.clear()
        self._halting_since: int | None = None
        self._unpowered_since: int | None = None
        self._far_since: dict[int, int] = {}
        self._low_since: int | None = None
        self._last = 0  # ns

    def take(self, frame: ResidualFrame, low_supply: float) -> Misfit:
        """Take the newest tick; `low_supply`: share of the nominal voltage that is too low."""
        now = frame.stamp_ns
        if now - self._last > _GAP:
            self.clear()
        self._last = now
        speeds = [frame.residuals[index] for index in SPEEDS]
        ignores = _ignores_commands(speeds)
        self._halting_since = _since(
            self._halting_since, now, holds=ignores or _is_about_to_stand(speeds)
        )
        # What no motor takes of the total is the computer's: it counts where they are not known.
        first = TOTAL if any(frame.residuals[index].stale for index in MOTORS) else TOTAL + 1
        far = [index for index in range(first, RESIDUALS) if is_far(frame.residuals[index])]
        self._far_since = {index: self._far_since.get(index, now) for index in far}
        is_low = frame.supply < low_supply + (_MORE if self._low_since is not None else 0.0)
        self._low_since = _since(self._low_since, now, holds=is_low)  # not where it is not known
        strays, obeys_others = self._strays(frame, speeds, is_low=is_low)
        far_since = min(self._far_since.values(), default=now)
        stands = ignores and _lasts(self._halting_since, now, _IGNORED_FOR)
        return Misfit(
            ignores,
            stands or strays,
            obeys_others,
            now - far_since >= _FAR_FOR,
            now - far_since >= _FAR_LONG,
            _lasts(self._low_since, now, _LOW_FOR),
        )

    def _strays(
        self, frame: ResidualFrame, speeds: list[Residual], *, is_low: bool
    ) -> tuple[bool, bool]:
        """Whether it brakes unasked or has long not been driven, and whether it obeys others."""
        now, motors = frame.stamp_ns, [frame.residuals[index] for index in MOTORS]
        astray = np.array([is_far(item) for item in speeds])
        far = int(np.count_nonzero(astray))
        beyond = np.array([item.modelled + item.residual for item in motors]) - self._idle
        bands = np.array([item.band for item in motors])
        is_idle = bool((np.abs(beyond) < _IDLE * bands).all())  # false where anything is NaN
        # Drivers that lack voltage do not drive, either.
        unpowered = is_idle and not is_low and far >= _AT_LEAST
        self._unpowered_since = _since(self._unpowered_since, now, holds=unpowered)
        is_unpowered = _lasts(self._unpowered_since, now, _IGNORED_FOR)
        brakes = self._brakes(now, speeds, far)
        derived = [frame.residuals[index] for index in ENCODERS]
        return brakes or is_unpowered, self._others.take(now, astray, beyond, derived)

    def _brakes(self, now: int, speeds: list[Residual], far: int) -> bool:
        """Whether it brakes to a halt that it is not asked for; `far`: wheels that are far off."""
        if self._braking is None:
            return False
        measured = np.array([measured_speed(item) for item in speeds])
        expected = np.array([item.modelled for item in speeds])
        return self._braking.take(now, measured, expected, far)


def _since(before: int | None, now: int, *, holds: bool) -> int | None:
    """Since when something holds, if it does."""
    if not holds:
        return None
    return now if before is None else before


def _lasts(since: int | None, now: int, long: int) -> bool:
    return since is not None and now - since >= long


def _ignores_commands(speeds: list[Residual]) -> bool:
    """Whether none of the wheels turns that are expected to, and there are enough of these."""
    turning = [item for item in speeds if abs(item.modelled) > _TURNING and not item.stale]
    return len(turning) >= _AT_LEAST and all(
        -_BACK < _followed(item) < _STANDING for item in turning
    )


def _is_about_to_stand(speeds: list[Residual]) -> bool:
    """Whether all wheels that are expected to turn are slower than that, and alike."""
    turning = [item for item in speeds if abs(item.modelled) > _TURNING and not item.stale]
    if len(turning) < _AT_LEAST or not all(is_far(item) for item in turning):
        return False
    followed = [_followed(item) for item in turning]
    return max(followed) < _HALTING and max(followed) - min(followed) < _ALIKE


def _followed(item: Residual) -> float:
    """Measured speed over the expected one; residuals are signed along the expected direction."""
    return 1.0 + item.residual / abs(item.modelled)


def is_far(item: Residual) -> bool:
    """Whether a residual is far out of its band."""
    return abs(item.residual) > _FAR * item.band  # false where either is NaN
