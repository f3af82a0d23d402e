"""How bad a named fault is, followed tick by tick.

Each quantity is the slope b of a change y on what it is a share of, x, fitted through the origin to
the ticks since the fault was named,

    b = sum x y / sum x^2.

The interval is of 95 %, by the jackknife over stretches of half a second, which the next one hardly
knows of; it is wider by the slope that the same robot showed while it was called well, which is
what its description lacks, or the fault before it was noticed, and by what a description does not
know: its constants to 5 %, the friction of an axle to a tenth. What includes 0 is not reported.
"""

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.conditions import ConditionsWatch
from tomr_fault_diag.classifier.severity.interval import Severity, slope
from tomr_fault_diag.classifier.severity.measures import MEASURES, Measure
from tomr_fault_diag.classifier.severity.tick import NEXT, Tick
from tomr_fault_diag.classifier.states import NORMAL, STATES, State
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_STRETCH = to_ns(0.5)
_CONSTANTS = 0.05  # of what a description says of them: how well they are known
_SELDOM = to_ns(0.2)  # between two looks at a robot that is well
_MOST = 60  # stretches that are remembered
_SUMS = sum(measure.wheels for measure in MEASURES)


class SeverityWatch:
    """Follows a robot tick by tick and says how bad what is named is."""

    def __init__(self, robot: Robot) -> None:
        self._motors = Motors(robot)
        self._conditions = ConditionsWatch(self._motors)
        self._places = _places()
        self.clear()

    def clear(self) -> None:
        """Forget all, also how the robot was when it was well."""
        # Sums of x^2 and x y over stretches, (2, _SUMS) each.
        self._well: deque[Array] = deque(maxlen=_MOST)
        self._ill: deque[Array] = deque(maxlen=_MOST)
        self._named: tuple[int | None, int | None, str] | None = None
        self._last: Tick | None = None
        self._due = 0  # when a robot that is well is looked at again [ns]
        self._conditions.clear()
        self._begin(0)

    def _begin(self, stretch: int) -> None:
        self._stretch = stretch
        self._sums = np.zeros((2, _SUMS))

    def take(self, frame: ResidualFrame, state: State, wheel: int | None) -> None:
        """Take a tick and what is named at it."""
        stretch = frame.stamp_ns // _STRETCH
        named = self._fault_of(state, wheel)
        if stretch != self._stretch or named != self._named:
            if self._sums.any():
                (self._well if self._named is None else self._ill).append(self._sums)
            self._begin(stretch)
        if named != self._named:
            self._ill.clear()
            self._named = named
        if named is not None:
            self._look(frame)
        elif state is STATES[NORMAL] and frame.stamp_ns >= self._due:
            self._look_at_well(frame)

    def _look(self, frame: ResidualFrame) -> Tick | None:
        with np.errstate(over="ignore", invalid="ignore"):
            tick = Tick.of(self._motors, frame, self._last)
            if tick is not None:
                sums = np.concatenate([measure.sums(tick) for measure in MEASURES], axis=1)
                if np.isfinite(sums).all():
                    self._sums += sums
                else:  # of a robot or a sensor that is beyond all numbers
                    tick = None
        self._last = tick
        return tick

    def _look_at_well(self, frame: ResidualFrame) -> None:
        """Take two ticks in a row now and then: one alone does not show how speeds change."""
        last = self._last
        tick = self._look(frame)
        if last is None or tick is None or frame.stamp_ns - last.stamp_ns > NEXT:
            return
        self._conditions.take(tick, last)
        self._due, self._last = frame.stamp_ns + _SELDOM, None

    def _fault_of(
        self, state: State, wheel: int | None
    ) -> tuple[int | None, int | None, str] | None:
        """What distinguishes faults; what ails a motor may turn out while it lasts."""
        if state not in self._places:
            return None
        return state.paper, wheel, "" if state.paper is not None else state.name

    @property
    def conditions(self) -> tuple[Severity, ...]:
        """What has changed slowly, and is no fault, as far as it can be estimated."""
        return self._conditions.changes

    def severity(self, state: State, wheel: int | None) -> Severity | None:
        """Of what is named, or None where there is nothing to report yet."""
        if state not in self._places:
            return None
        measure, place = self._places[state]
        if measure.wheels > 1:
            if wheel is None:
                return None
            place += wheel
        found = _slope(self._ill, place)
        if found is None:
            return None
        value, half = found
        if not measure.is_absolute:
            half += abs((_slope(self._well, place) or (0.0, 0.0))[0])
        half += _CONSTANTS * abs(value) + measure.doubt(self._motors)
        if abs(value) < half:
            return None
        return Severity(measure.quantity, measure.unit, value, value - half, value + half)


def _places() -> Mapping[State, tuple[Measure, int]]:
    """The measure of each state, and where its first sum stands."""
    found, place = {}, 0
    for measure in MEASURES:
        found.update(dict.fromkeys(measure.states, (measure, place)))
        place += measure.wheels
    return found


def _slope(stretches: Sequence[Array], place: int) -> tuple[float, float] | None:
    x, y = np.array([sums[:, place] for sums in stretches]).reshape(-1, 2).T
    return slope(x, y)
