"""Whether commands and sensors are stamped by clocks that agree, as far as stamps show it."""

from collections import deque
from statistics import median

from tomr_power_model.model.ticks import to_ns

_KEPT = 21  # commands
_BEHIND = to_ns(0.1)  # a command that comes so late is taken for none
_AHEAD = to_ns(0.25)  # sensors that come so late are not waited for


class CommandClock:
    """Holds each command's stamp against the newest of a sensor when it came."""

    def __init__(self, delay_ns: int) -> None:
        """`delay_ns`: that commands act after their stamps, by the robot's description."""
        self._delay = delay_ns
        self._ahead: deque[int] = deque(maxlen=_KEPT)
        self._sensors = 0  # newest stamp of a sensor at the last command [ns]

    def clear(self) -> None:
        """Forget what came."""
        self._ahead.clear()
        self._sensors = 0

    def take(self, stamp_ns: int, sensors_ns: int) -> None:
        """Take a command's stamp, and the newest of the sensors; 0 where none came yet."""
        if sensors_ns != self._sensors:  # of sensors that died it says nothing
            self._ahead.append(stamp_ns - sensors_ns)
            self._sensors = sensors_ns

    def ailment(self) -> str:
        """What is to be said of it, empty where all is well."""
        if len(self._ahead) < _KEPT:
            return ""
        ahead = round(median(self._ahead))
        seconds = 1e-9 * abs(ahead)
        if ahead > _AHEAD:
            return f"stamped {seconds:.1f} s ahead of the sensors: synchronise the clocks"
        if ahead + self._delay < -_BEHIND:
            return (
                f"comes {seconds:.1f} s after its stamps: synchronise the clocks, or set "
                "controller.delay"
            )
        return ""
