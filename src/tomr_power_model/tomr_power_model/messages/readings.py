"""A supply reading as it travels: single precision, current negative while power is drawn."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen

NAN = float("nan")


@frozen
class SupplyReading:
    """Voltage [V] and current [A] of a BatteryState, rounded as the message rounds them."""

    voltage: float
    current: float

    @property
    def power(self) -> float:
        """Power drawn, P = -voltage * current [W]."""
        return -self.voltage * self.current

    @property
    def drawn_current(self) -> float:
        """Current drawn [A], positive while it draws."""
        return -self.current

    @classmethod
    def rounded(cls, voltage: float, drawn_current: float) -> Self:
        """A reading of current drawn at a voltage, in the message's precision."""
        return cls(float(np.float32(voltage)), float(np.float32(-drawn_current)))


UNKNOWN_READING = SupplyReading(NAN, NAN)


def readings(voltages: Sequence[float], currents: Sequence[float]) -> tuple[SupplyReading, ...]:
    """Readings of several supplies."""
    return tuple(
        SupplyReading.rounded(voltage, current)
        for voltage, current in zip(voltages, currents, strict=True)
    )


# What a BatteryState says of a supply that is no battery: the message asks for NaN.
BATTERY_UNKNOWNS = {
    "temperature": NAN,
    "charge": NAN,
    "capacity": NAN,
    "design_capacity": NAN,
    "percentage": NAN,
}
