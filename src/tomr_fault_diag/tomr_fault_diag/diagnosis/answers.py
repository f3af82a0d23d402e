"""Whether wheels turn as fast as the description has them: radii that the drivers do not share."""

from array import array

import numpy as np
from attrs import define, field

from tomr_fault_diag.residuals.frame import SPEEDS, ResidualFrame, measured_speed
from tomr_power_model.drive.radii import answer, misdescribed
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import WHEELS, Robot


@define
class Answers:
    """Wheel speeds of a recording, tick by tick."""

    _stamps: "array[int]" = field(factory=lambda: array("q"))  # ns
    _measured: "array[float]" = field(factory=lambda: array("d"))  # rad/s, three a tick
    _modelled: "array[float]" = field(factory=lambda: array("d"))  # the same

    def frame(self, frame: ResidualFrame) -> None:
        """Note a tick."""
        speeds = [frame.residuals[index] for index in SPEEDS]
        self._stamps.append(frame.stamp_ns)
        self._measured.extend([measured_speed(speed) for speed in speeds])
        self._modelled.extend([speed.modelled for speed in speeds])

    def note(self, robot: Robot) -> str:
        """What to write into the description, empty where nothing."""
        if len(self._stamps) < 2:
            return ""
        time = (np.array(self._stamps) - self._stamps[0]) / NANOSECONDS
        measured, modelled = (
            np.array(rows).reshape(-1, WHEELS) for rows in (self._measured, self._modelled)
        )
        seen, remedy = misdescribed(answer(time, measured, modelled, robot), robot)
        return f"wheels and commands: {seen}: {remedy}" if seen else ""
