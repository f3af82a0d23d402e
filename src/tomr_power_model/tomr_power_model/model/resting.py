"""The voltages that drivers hold while their wheels are at rest, from what the drivers see.

A wheel at rest may hold any torque up to its dry friction: its motion does not tell. Its driver's
law does, on the measured speeds:

    v = k_p (asked - omega) + k_i I,   I = integral of (asked - omega) = I_sim + theta_sim - theta

for simulation and driver are asked for the same, and both sum up. What a start in motion or
saturation left different fades while the wheel turns: there motion and simulation tell the sum.
"""

from collections.abc import Sequence

from tomr_power_model.dynamics import layout as at
from tomr_power_model.model.commanded import CommandPath
from tomr_power_model.robot import Controller

_UNKNOWN = float("nan")
MOVING = 1.0  # rad/s
FADES = 0.01  # share of the difference in a tick in motion


class RestingDrivers:
    """Sums of the drivers, one per wheel."""

    def __init__(self, controller: Controller, wheels: int) -> None:
        self._proportional = controller.proportional
        self._integral = controller.integral
        self._wheels = wheels
        self.clear()

    def clear(self) -> None:
        """What the drivers' sums hold is not known until the next command."""
        self._offset = [_UNKNOWN] * self._wheels  # rad
        self._before = [_UNKNOWN] * self._wheels  # V, at the end of the last tick

    def voltages(
        self, path: CommandPath, angle: Sequence[float], speed: Sequence[float], share: float
    ) -> list[float]:
        """Voltage that each driver holds at some time of a tick [V], NaN before the first command.

        Args:
            path: that simulates what the drivers are asked for.
            angle: of the wheels at the end of the tick [rad], NaN where not known.
            speed: of the wheels [rad/s].
            share: of the tick at that time.
        """
        if path.state is None:
            return [_UNKNOWN] * self._wheels
        found = []
        asked, sums = path.wheel(at.ASKED), path.wheel(at.INTEGRAL)
        turned = path.wheel(at.TURNED)
        for wheel in range(self._wheels):
            ahead = turned[wheel] - angle[wheel]
            if ahead == ahead and self._offset[wheel] != self._offset[wheel]:
                self._offset[wheel] = -ahead
            if abs(speed[wheel]) > MOVING:
                self._offset[wheel] -= FADES * (ahead + self._offset[wheel])
            known = ahead + self._offset[wheel]
            total = sums[wheel] + (known if known == known else 0.0)
            error = asked[wheel] - speed[wheel]
            found.append(self._proportional * error + self._integral * total)
        before, self._before = self._before, found
        return [
            first + share * (last - first) if first == first else last
            for first, last in zip(before, found, strict=True)
        ]
