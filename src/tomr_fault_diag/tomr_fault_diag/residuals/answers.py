"""Whether wheels turn as fast as the description has them: radii that the drivers do not share."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from tomr_fault_diag.residuals.frame import Residual, measured_speed
from tomr_power_model.drive.radii import answer, misdescribed
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.input_health import Remark
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS, Robot

_KEPT = to_ns(120.0)  # of driving
_EVERY = to_ns(5.0)
_TURNS = 0.3  # rad/s: where all wheels are to turn slower, a tick shows nothing


class AnswerWatch:
    """Wheel speeds of the last minutes of driving, and what they say of the description.

    A restart forgets nothing: the description stays what it is.
    """

    def __init__(self, robot: Robot, period_ns: int) -> None:
        self._robot = robot
        self._period = period_ns
        # Measured and modelled [rad/s].
        self._speeds: deque[tuple[float, ...]] = deque(maxlen=_KEPT // period_ns)
        self._slot = 0
        self._words = ""

    def take(self, tick_ns: int, speeds: Sequence[Residual]) -> None:
        """Take the wheel speeds of a tick."""
        modelled = [speed.modelled for speed in speeds]
        if any(abs(speed) > _TURNS for speed in modelled):  # false where unknown
            measured = [measured_speed(speed) for speed in speeds]
            self._speeds.append((*measured, *modelled))
        slot = tick_ns // _EVERY
        if slot != self._slot:
            self._slot, self._words = slot, self.words()

    def words(self) -> str:
        """What speaks against the description so far and what to write, empty where nothing."""
        if len(self._speeds) < 2:
            return ""
        rows = np.array(self._speeds)
        time = np.linspace(0.0, 1e-9 * self._period * (len(rows) - 1), len(rows))
        found = answer(time, rows[:, :WHEELS], rows[:, WHEELS:], self._robot)
        seen, remedy = misdescribed(found, self._robot)
        return f"wheels and commands: {seen}: {remedy}" if seen else ""

    def remark(self) -> Remark:
        """What is to be said of the description, as it was looked at last."""
        if self._words:
            return Remark("robot.yaml", Level.WARN, self._words)
        return Remark("robot.yaml", Level.OK, "nothing speaks against it")
