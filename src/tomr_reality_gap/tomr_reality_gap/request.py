"""What is to be explained."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from attrs import field, frozen

DEFAULT_TOLERANCE = 0.02


@frozen
class Request:
    """One robot, its recordings, and how far its description may be off (relative)."""

    robot: str | Path  # robot.yaml, or the name of a shipped one
    real: tuple[Path, ...]
    sim: Path | None = None
    holdout: tuple[Path, ...] = ()
    tolerance: float = DEFAULT_TOLERANCE  # of all values
    tolerances: Mapping[str, float] = field(factory=dict)  # of single ones, by key
    skips: Mapping[str, Sequence[tuple[float, float]]] = field(factory=dict)  # s, by recording

    @property
    def recordings(self) -> tuple[Path, ...]:
        """All of them."""
        return (*self.real, *self.holdout, *((self.sim,) if self.sim else ()))
