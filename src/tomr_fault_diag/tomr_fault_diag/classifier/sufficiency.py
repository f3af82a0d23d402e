"""Whether a frame holds data to decide by, and which motors have none of their own.

Around a gap of the commands or the encoders, or of all power, nothing can be concluded from a
frame; where this is so for half of the last second, there is not enough data for any state. A motor
whose power is not known is neither accused nor cleared.
"""

from collections import deque

from attrs import frozen

from tomr_fault_diag.residuals.frame import (
    FROZEN,
    GAP,
    MOTORS,
    NOT_MEASURED,
    SCATTER,
    SPEEDS,
    TOTAL,
    Residual,
    ResidualFrame,
)
from tomr_power_model.model.ticks import to_ns

_LATELY = to_ns(1.0)
# Without a motor's power, before its sensor is to blame: dropouts of a second are nobody's fault,
# and readings repeat by themselves for up to 0.7 s on the real Robotino.
_DEAD, _STUCK = to_ns(1.5), to_ns(1.0)
_FROZEN = "power sensor frozen"
_LEAST = 0.5  # share of the frames of that time that must be usable

Blind = tuple[tuple[int, str], ...]  # wheels (0..2), and what ails the sensor, "" for a moment


@frozen
class Sufficiency:
    """What a frame and those before it allow to say."""

    usable: bool  # this frame
    joined: bool  # it follows another usable one without a gap
    enough: bool  # usable frames lately
    blind: Blind = ()


class SufficiencyWatch:
    """Remembers which of the last frames could be used."""

    def __init__(self) -> None:
        self._frames: deque[tuple[int, bool]] = deque()
        self._since: dict[int, int] = {}  # wheel: since when it is blind [ns]

    def clear(self) -> None:
        """Forget all frames."""
        self._frames.clear()
        self._since.clear()

    def take(self, frame: ResidualFrame) -> Sufficiency:
        """Take the newest frame."""
        usable = _is_usable(frame)
        before = self._frames[-1] if self._frames else (0, False)
        joined = usable and before[1] and frame.stamp_ns - before[0] < _LATELY
        self._frames.append((frame.stamp_ns, usable))
        while self._frames[0][0] <= frame.stamp_ns - _LATELY:
            self._frames.popleft()
        share = sum(good for _, good in self._frames) / len(self._frames)
        return Sufficiency(usable, joined, share >= _LEAST, self._blind(frame))

    def _blind(self, frame: ResidualFrame) -> Blind:
        motors = [frame.residuals[index] for index in MOTORS]
        blind = {wheel: _ailment(item) for wheel, item in enumerate(motors) if _is_unmeasured(item)}
        now = frame.stamp_ns
        self._since = {wheel: self._since.get(wheel, now) for wheel in blind}
        return tuple(
            (wheel, reason if now - self._since[wheel] >= _patience(reason) else "")
            for wheel, reason in blind.items()
        )


def _is_usable(frame: ResidualFrame) -> bool:
    """Whether the power of any motor, or of all, can be compared, and the speed of any wheel."""
    powers, speeds = ([frame.residuals[k] for k in group] for group in ((TOTAL, *MOTORS), SPEEDS))
    # Encoders that speak, but not clearly, leave the powers to be compared.
    heard = any(not item.stale or item.missing == SCATTER for item in speeds)
    return heard and not all(item.stale for item in powers)


def _is_unmeasured(item: Residual) -> bool:
    known = item.modelled == item.modelled
    return item.stale and known and item.missing != NOT_MEASURED


def _ailment(item: Residual) -> str:
    if item.missing.startswith(GAP):
        return ""
    return _FROZEN if item.missing.endswith(FROZEN) else "power sensor dead"


def _patience(reason: str) -> int:
    return _STUCK if reason == _FROZEN else _DEAD
