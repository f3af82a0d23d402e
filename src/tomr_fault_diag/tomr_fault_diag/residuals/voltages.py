"""What the drivers hold beside what they hold in the simulation.

A driver's law on the measured speeds, or what it says itself, gives its voltage to some hundredths
of a volt, whatever friction there is. Power tells how hard a motor works, the voltage what it takes
for it: a winding, a bearing and a sensor that is off show apart.
"""

from collections import deque

from tomr_fault_diag.residuals.frame import (
    NO_COMMAND,
    NO_ENCODERS,
    UNKNOWN_VOLTAGE,
    Residual,
    rounded,
)
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.widths import width
from tomr_power_model.model.prediction import Prediction, Triple
from tomr_power_model.robot import WHEELS

Voltages = tuple[Residual, Residual, Residual]


class VoltageWatch:
    """Compares tick by tick."""

    def __init__(self, lately: int) -> None:
        """`lately`: ticks over which the change of what is expected widens the bands."""
        self._recent: deque[Triple] = deque(maxlen=lately)

    def clear(self) -> None:
        """Forget the past."""
        self._recent.clear()

    def residuals(self, prediction: Prediction | None, bands: BandSettings) -> Voltages:
        """Of a tick; unknown without a prediction."""
        if prediction is None:
            return (UNKNOWN_VOLTAGE,) * 3
        self._recent.append(prediction.voltage)
        first, second, third = (
            self._residual(wheel, prediction.held[wheel], bands) for wheel in range(WHEELS)
        )
        return first, second, third

    def _residual(self, wheel: int, held: float, bands: BandSettings) -> Residual:
        models = [past[wheel] for past in self._recent]
        model, band = models[-1], width(models, bands.of_voltage)
        missing = "" if held == held else NO_ENCODERS
        if model != model:
            missing = NO_COMMAND
        return Residual(rounded(held - model), rounded(band), rounded(model), "V", missing)
