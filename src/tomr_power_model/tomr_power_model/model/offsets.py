"""What the drivers' sums of errors are beyond the simulated ones, one per wheel.

    I - I_sim = theta_sim - theta + offset

for simulation and driver are asked for the same, and both sum up.
"""

from collections.abc import Sequence

from tomr_power_model.robot import WHEELS

UNKNOWN = float("nan")


class Offsets:
    """Follows the wheels' offsets [rad] tick by tick; one that is not known makes sums equal."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """None is known any more."""
        self._offset = [UNKNOWN] * WHEELS

    def beyond(self, wheel: int, ahead: float, fades: float) -> float:
        """By how much a driver's sum is ahead [rad], NaN where that is not known.

        `ahead`: by how much the simulated wheel has turned further [rad]; `fades`: share of the
        difference that a tick takes off.
        """
        if self._offset[wheel] != self._offset[wheel]:
            self.equal(wheel, ahead)
        self._offset[wheel] -= fades * (ahead + self._offset[wheel])
        return ahead + self._offset[wheel]

    def equal(self, wheel: int, ahead: float) -> None:
        """Take both sums for equal, of a wheel that is so far ahead in the simulation [rad]."""
        self._offset[wheel] = -ahead

    def lower(self, wheel: int, angle: float) -> None:
        """The sums are so much less apart [rad]."""
        self._offset[wheel] -= angle


def between(before: Sequence[float], now: Sequence[float], share: float) -> list[float]:
    """At a share of the time since `before`, linearly; as now where that is not known."""
    return [
        first + share * (last - first) if first == first else last
        for first, last in zip(before, now, strict=True)
    ]
