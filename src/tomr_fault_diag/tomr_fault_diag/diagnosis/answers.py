"""Whether wheels turn as fast as the description has them: radii that the drivers do not share."""

import numpy as np
from attrs import define, field

from tomr_fault_diag.residuals.frame import SPEEDS, ResidualFrame, measured_speed
from tomr_power_model.drive.radii import answer, misdescribed
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import Robot


@define
class Answers:
    """Wheel speeds of a recording, tick by tick."""

    _stamps: list[int] = field(factory=list)
    _measured: list[list[float]] = field(factory=list)  # rad/s
    _modelled: list[list[float]] = field(factory=list)  # rad/s

    def frame(self, frame: ResidualFrame) -> None:
        """Note a tick."""
        speeds = [frame.residuals[index] for index in SPEEDS]
        self._stamps.append(frame.stamp_ns)
        self._measured.append([measured_speed(speed) for speed in speeds])
        self._modelled.append([speed.modelled for speed in speeds])

    def note(self, robot: Robot) -> str:
        """What to write into the description, empty where nothing."""
        if len(self._stamps) < 2:
            return ""
        time = (np.array(self._stamps) - self._stamps[0]) / NANOSECONDS
        found = answer(time, np.array(self._measured), np.array(self._modelled), robot)
        seen, remedy = misdescribed(found, robot)
        return f"wheels and commands: {seen}: {remedy}" if seen else ""
