"""What dry friction holds a standing robot's wheels against."""

from collections.abc import Sequence

import numpy as np

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import Vehicle


class Holding:
    """Friction of the axles, and of the rollers of all wheels, at standstill.

    A side force g_j at a roller resists the torque of wheel i as far as a turn of that wheel slides
    it: by virtual work g_j d(slide_j)/d(angle_i), the twist that belongs to the turn of one wheel
    being a column of the pseudo-inverse.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        wheels = wheel_records(laid_out(vehicle))
        along, twist = (wheels[:, first : first + 3] for first in (at.ALONG, at.TO_TWIST))
        self._slides = np.abs(twist @ along.T).tolist()  # [i][j], m
        self._constant = wheels[:, at.CONSTANT].tolist()  # N m/A

    def voltages(
        self, dry: Sequence[float], side: Sequence[float], resistance: Sequence[float]
    ) -> list[float]:
        """Most that each driver can apply without a wheel beginning to turn [V], (n,).

        Args:
            dry: limit of the friction at each axle [N m].
            side: limit of the side force at each wheel [N].
            resistance: of the windings [ohm].
        """
        found = []
        for wheel, slides in enumerate(self._slides):
            sides = sum(slide * force for slide, force in zip(slides, side, strict=True))
            found.append((dry[wheel] + sides) * resistance[wheel] / self._constant[wheel])
        return found
