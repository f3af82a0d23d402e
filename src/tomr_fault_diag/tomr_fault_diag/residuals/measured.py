"""Measured power or current of one supply, averaged over the window of a tick."""

import math
from collections import deque

from attrs import frozen

from tomr_fault_diag.residuals.frame import Unit
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.messages.readings import NAN
from tomr_power_model.model.ticks import of_tick


@frozen
class Measured:
    """A mean [W or A] and its unit; NaN where there is no fresh sample."""

    value: float
    unit: Unit
    missing: str = ""  # why it is not known


class SupplyWindow:
    """Keeps the readings of one supply; where it reports no voltage, its current is compared.

    Nothing is filled in: a window without a sample takes the newest one that is not stale.
    """

    def __init__(self, period_ns: int, stale_ns: int, signed: bool = True) -> None:
        self._period = period_ns
        self._stale = stale_ns
        self._signed = signed
        self._samples: deque[tuple[int, float, float, float]] = deque()

    def clear(self) -> None:
        """Forget all samples."""
        self._samples.clear()

    def add(self, reading: PowerReading) -> None:
        """Take a reading newer than those before."""
        drawn = reading.current if self._signed else abs(reading.current)
        self._samples.append((reading.stamp_ns, reading.power, drawn, reading.voltage))

    def at(self, tick_ns: int) -> Measured:
        """Mean over (tick - period, tick]: power, or current if the voltage is unknown."""
        inside = of_tick(self._samples, tick_ns, self._period, self._stale)
        if not inside:
            return Measured(NAN, "W")
        powers = [s[1] for s in inside if s[1] == s[1]]  # not NaN
        if powers:
            return Measured(sum(powers) / len(powers), "W")
        currents = [current for _, _, current, _ in inside if not math.isnan(current)]
        return Measured(sum(currents) / len(currents) if currents else NAN, "A")

    def voltage_at(self, tick_ns: int) -> float:
        """Mean voltage over (tick - period, tick] [V], NaN where it is not reported."""
        inside = of_tick(self._samples, tick_ns, self._period, self._stale)
        voltages = [voltage for _, _, _, voltage in inside if not math.isnan(voltage)]
        return sum(voltages) / len(voltages) if voltages else NAN
