"""Means over one tick: what the two paths say of the drives."""

from collections.abc import Sequence
from typing import Self

from attrs import frozen

from tomr_power_model.dynamics.drives import DrivePower
from tomr_power_model.robot import WHEELS


@frozen
class Means:
    """Means over a tick, one number per wheel; NaN where the motion is."""

    torque: Sequence[float]  # N m
    current: Sequence[float]  # A
    at_motor: Sequence[float]  # voltage * current [W]
    power: Sequence[float]  # W
    other: float | None = None  # of computer and sensors [W]; None: as described
    voltage: float | None = None  # of the supply [V]; None: nominal, less what sags
    drives: float | None = None  # of all drives, where it is known by itself [W]
    # Whether friction is known to hold each wheel, should it rest, against its driver's voltage.
    obeyed: Sequence[bool] = (False,) * WHEELS

    @classmethod
    def of(cls, drives: DrivePower) -> Self:
        """Means over all rows."""
        return cls(
            torque=drives.torque.mean(axis=0).tolist(),
            current=drives.current.mean(axis=0).tolist(),
            at_motor=(drives.voltage * drives.current).mean(axis=0).tolist(),
            power=drives.power.mean(axis=0).tolist(),
            other=None if drives.other is None else float(drives.other.mean()),
        )

    @property
    def total(self) -> float:
        """Power of all drives [W]."""
        return sum(self.power) if self.drives is None else self.drives
