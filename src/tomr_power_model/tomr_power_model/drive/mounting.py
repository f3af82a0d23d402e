"""Holds an IMU against gravity and the wheels while the robot drives."""

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.imu_mistakes import Felt, imu_mistake
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

SLOT = NANOSECONDS // 10  # over which what is measured is averaged
_LONGEST = 3 * SLOT  # the wheels were not known in between
_EVERY = NANOSECONDS  # between two looks
_KEPT = 600  # slots of driving
_MOVES = 0.02  # m/s, rad/s
_MOST = 1024  # samples, should nobody look


class MountingWatch:
    """What an IMU measured in the last minute of driving, and what is wrong with it.

    A leap of the stamps forgets samples, and nothing that was found: it is the same IMU.
    """

    def __init__(self, robot: Robot) -> None:
        self._rpy = robot.imu_rpy
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_KEPT)
        self._samples: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=_MOST)
        self._before: tuple[int, Array] | None = None  # when the slot began, and the twist then
        self._looked = 0
        self._found: str | None = None
        self.mistake = ""  # that was seen twice in a row, in words

    def clear(self) -> None:
        """Forget what no slot has yet."""
        self._samples.clear()
        self._before = None

    def add(self, stamp_ns: int, values: Sequence[float]) -> None:
        """Take angular rates [rad/s] and specific forces [m/s^2], x, y and z each, NaN for what is
        not measured."""
        self._samples.append((stamp_ns, tuple(values)))

    def look(self, stamp_ns: int, twist: Array) -> bool:
        """Hold what was measured against the twist that the wheels show at a time [m/s, m/s,
        rad/s], (3,), NaN where unknown; returns whether a mistake is found now."""
        if self._before is not None and 0 <= stamp_ns - self._before[0] < SLOT:
            return False
        before, self._before = self._before, (stamp_ns, np.array(twist))
        if before is not None and 0 < stamp_ns - before[0] < _LONGEST:
            self._take(before, self._before)
        if abs(stamp_ns - self._looked) < _EVERY or not self._rows:
            return False
        self._looked = stamp_ns
        return self._judge()

    def _take(self, before: tuple[int, Array], after: tuple[int, Array]) -> None:
        (begin, old), (end, new) = before, after
        while self._samples and self._samples[0][0] <= begin:
            self._samples.popleft()
        found = [values for stamp, values in self._samples if stamp <= end]
        v_x, v_y, turning = (0.5 * (old + new)).tolist()
        moves = max(abs(v_x), abs(v_y), abs(turning)) > _MOVES  # false where NaN
        if not found or not moves:
            return
        a_x, a_y, _ = ((new - old) * (1e9 / (end - begin))).tolist()
        measured = np.mean(found, axis=0).tolist()
        self._rows.append((turning, a_x - turning * v_y, a_y + turning * v_x, *measured))

    def _judge(self) -> bool:
        rows = np.array(self._rows)
        felt = Felt(rows[:, 0], rows[:, 1:3], rows[:, 3:6], rows[:, 6:])
        found, before = imu_mistake(felt, self._rpy), self._found
        if found is None:
            return False
        self._found = found
        if bool(found) is not bool(before):
            return False
        was, self.mistake = self.mistake, found
        return bool(found and not was)
