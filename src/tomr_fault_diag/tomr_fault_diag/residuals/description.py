"""Whether the robot is the one that is described, and wired as described, while it drives."""

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import Residual, measured_speed
from tomr_power_model.drive.exchanged import exchange_words, exchanged
from tomr_power_model.drive.mistakes import gross_mistake
from tomr_power_model.drive.radii import answer, misdescribed
from tomr_power_model.drive.ramp import misdescribed_ramp, ramp_shown
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.input_health import Remark
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_KEPT = to_ns(120.0)  # of driving
_EVERY = to_ns(5.0)
_CLOSEST = to_ns(0.05)  # of ticks: more of them show no more
_LEAST = to_ns(5.0)  # of driving, before which a fault may be all that is seen
_TURNS = 0.3  # rad/s: where all wheels are to turn slower, a tick shows nothing
_MANY = 400  # ticks that a power's sign is judged by
_REVERSED = -0.5  # W that a motor draws more for each that it should


@frozen
class _Driving:
    """Ticks of driving, (n, 3) each, NaN where unknown."""

    time: Array  # s, (n,)
    speed: Array  # measured [rad/s]
    asked: Array  # as the model has it [rad/s]
    power: Array  # measured [W] or [A]
    expected: Array  # as the model has it, likewise


Said = tuple[str, str]  # what is seen and what to mend, empty where nothing
_NOTHING: Said = ("", "")


def _mistaken(driving: _Driving, robot: Robot, *, slower: bool = False) -> Said:
    twist = driving.asked @ np.linalg.inv(twist_to_wheels(robot, nominal=True)).T
    seen, remedy = gross_mistake(twist, driving.speed, robot, slower=slower)
    return f"wheels and commands: {seen}" if seen else "", remedy


def _other_sizes(driving: _Driving, robot: Robot) -> Said:
    gross = _mistaken(driving, robot, slower=True)
    if gross != _NOTHING:
        return gross
    found = answer(driving.time, driving.speed, driving.asked, robot)
    seen, remedy = misdescribed(found, robot)
    return f"wheels and commands: {seen}" if seen else "", remedy


def _reversed(driving: _Driving, robot: Robot) -> Said:
    names = [
        f"the power of {topic}"
        for topic, drawn, expected in zip(
            robot.wheel_topics, driving.power.T, driving.expected.T, strict=True
        )
        if _is_reversed(drawn, expected)
    ]
    if not names:
        return _NOTHING
    return (
        f"{', '.join(names)} {'has' if len(names) == 1 else 'have'} the wrong sign",
        "mend it in the driver (BatteryState.current is negative while drawing), or set "
        "measurement.signed: false if the sensor gives magnitudes",
    )


def _is_reversed(drawn: Array, expected: Array) -> bool:
    """Whether a motor (n,) draws less the more it should, for longer than a slope goes down."""
    known = np.isfinite(drawn) & np.isfinite(expected)
    drawn, expected = drawn[known], expected[known]
    if len(drawn) < _MANY or np.sum(drawn) >= 0.0:
        return False
    change = expected - np.mean(expected)
    return bool(drawn @ change < _REVERSED * (change @ change))


def _exchanged(driving: _Driving, robot: Robot) -> Said:
    order = exchanged(driving.power, driving.expected[:, :, None])
    return _NOTHING if order is None else exchange_words(order, robot)


def _ramped(driving: _Driving, robot: Robot) -> Said:
    found = ramp_shown(driving.time, driving.speed, driving.asked, robot)
    return misdescribed_ramp(found, robot)


# What no fault looks like: residuals mean nothing until it is mended.
_GROSS: Sequence[Callable[[_Driving, Robot], Said]] = (_mistaken, _reversed, _exchanged, _ramped)


def _sentence(said: Said) -> str:
    seen, remedy = said
    return f"{seen}: {remedy}" if seen else ""


class DescriptionWatch:
    """Holds the last minutes of driving against the description and the wiring.

    A restart forgets nothing: the description stays what it is.
    """

    def __init__(self, robot: Robot, period_ns: int) -> None:
        self._robot = robot
        self._period = max(period_ns, _CLOSEST)
        self._ticks: deque[tuple[float, ...]] = deque(maxlen=_KEPT // self._period)
        self._first = self._last = 0  # stamps of ticks that were taken [ns]
        self._slot = 0
        self._words = ""
        self._gross = _NOTHING  # as it was looked at last
        self.mistake = ""  # a gross one that was seen twice in a row

    def take(self, tick_ns: int, speeds: Sequence[Residual], powers: Sequence[Residual]) -> None:
        """Take the wheels' speeds and the motors' powers of a tick."""
        asked = [speed.modelled for speed in speeds]
        is_new = not 0 <= tick_ns - self._last < self._period
        if is_new and any(abs(speed) > _TURNS for speed in asked):  # false where unknown
            self._first, self._last = self._first or tick_ns, tick_ns
            seconds = 1e-9 * (tick_ns - self._first)
            measured = [measured_speed(speed) for speed in speeds]
            expected = [power.modelled for power in powers]
            drawn = [power.modelled + power.residual for power in powers]
            self._ticks.append((seconds, *measured, *asked, *drawn, *expected))
        slot = tick_ns // _EVERY
        if slot != self._slot:
            self._slot = slot
            gross, self._words = self._seen()
            # What is seen but once may be a mixture of what was before a stop and after.
            self.mistake = _sentence(gross) if gross[1] == self._gross[1] else ""
            self._gross = gross

    def words(self) -> str:
        """What speaks against the description so far and what to mend, empty where nothing."""
        return self._seen()[1]

    def _seen(self) -> tuple[Said, str]:
        """A gross mistake, and in words that or what else is not as described."""
        if len(self._ticks) * self._period < _LEAST:
            return _NOTHING, ""
        rows = np.array(self._ticks)
        driving = _Driving(rows[:, 0], *np.hsplit(rows[:, 1:], 4))
        found = (check(driving, self._robot) for check in _GROSS)
        gross = next((said for said in found if said != _NOTHING), _NOTHING)
        return gross, _sentence(gross) or _sentence(_other_sizes(driving, self._robot))

    def remark(self) -> Remark:
        """What is to be said of the description, as it was looked at last."""
        if self._words:
            return Remark("robot.yaml", Level.WARN, self._words)
        return Remark("robot.yaml", Level.OK, "nothing speaks against it")
