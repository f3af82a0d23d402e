"""Whether drivers ramp the velocity that is commanded as the description says.

Where it has no ramp, or a steeper one, the measured velocity is the simulated one ramped once more;
where it has a gentler one, the simulated velocity is the measured one ramped. No fault looks like
that: a wheel that is weak, held or slides goes somewhere else, and not at one pace each time. Loops
with other gains do come later or sooner, but as a lag does; commands that are late by a time.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Plane = NDArray[np.complex128]  # velocities in the plane of the floor, x + i y

_NOTABLE = 0.08  # of the root mean square speed, that the two differ by: healthy robots by 0.02
_APART = 0.25  # of that speed: a sample in which the drivers ramp
_TIMES = 5  # how often they have to
_PARTS = (0.5, 0.6, 0.75, 0.9, 1.0)  # of the limit: wheels swing, without a ramp the most
_LAGS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)  # s
_LATE = np.arange(0.02, 0.62, 0.02)  # s
_RAMPED = 0.45  # part of the difference that is left with a ramp
_RATHER = 1.25  # times what is left with a lag: loops blur a ramp
_BREAK = 1.5  # periods between two samples that do not go together
_AROUND = 0.5  # s before and after a ramp, in which loops settle
_MUCH = 0.5  # of that speed, that a ramp changes
_ENOUGH = 3  # ramps that show how steep they are: the median leaves out those cut short
_MOSTLY = 90.0  # percentile of the acceleration, where there are fewer


def ramp_shown(time: Array, measured: Array, expected: Array, robot: Robot) -> float | None:
    """Acceleration [m/s^2] that drivers keep to and the description does not; None where it does,
    or where that does not show.

    Args:
        time: of samples, evenly spaced but for what is left out [s], (n,).
        measured: wheel speeds then [rad/s], (n, 3), NaN where unknown.
        expected: those of the description's simulation [rad/s], (n, 3), the same.
        robot: the description.
    """
    found = _velocities(time, measured, expected, robot)
    if found is None:
        return None
    apart = found.off > _APART * found.size
    begins = np.count_nonzero(np.diff(apart.astype(int)) > 0)
    total = float(np.sum(found.off**2))
    if begins < _TIMES or total < len(apart) * (_NOTABLE * found.size) ** 2:
        return None
    described = robot.controller.acceleration_limit
    limit = _limit(found, apart, described) or _pace(found, apart)
    if not limit:
        return None
    is_steeper = 0.0 < described < limit
    fast, slow = (found.seen, found.asked) if is_steeper else (found.asked, found.seen)
    step = (described if is_steeper else limit) * found.period

    def left(follow: Callable[[complex], complex]) -> float:
        return _left(fast, slow, found.stretches, follow)

    ramped = min(left(_ramp(part * step)) for part in _PARTS)
    if ramped > _RAMPED**2 * total:
        return None
    lagged = min(left(_lag(seconds / found.period)) for seconds in _LAGS)
    late = min(_left_late(fast, slow, found.stretches, seconds / found.period) for seconds in _LATE)
    return limit if ramped < min(_RATHER * lagged, late) else None


@frozen
class _Velocities:
    """What is measured and what is simulated, in the samples in which both are known, (n,)."""

    time: Array  # s
    seen: Plane  # m/s
    asked: Plane  # m/s
    period: float  # s
    size: float  # root mean square of what is simulated [m/s]
    stretches: tuple[slice, ...]  # without a gap

    @property
    def off(self) -> Array:
        """How far the two are apart [m/s], (n,)."""
        return np.abs(self.seen - self.asked)


def _velocities(time: Array, measured: Array, expected: Array, robot: Robot) -> _Velocities | None:
    to_twist = np.linalg.inv(twist_to_wheels(robot, nominal=True)).T
    seen, asked = ((speeds @ to_twist)[:, :2] @ (1.0, 1.0j) for speeds in (measured, expected))
    known = np.isfinite(seen) & np.isfinite(asked)
    if np.count_nonzero(known) < 2:
        return None
    time, seen, asked = time[known], seen[known], asked[known]
    period = median_period(time)
    breaks = np.flatnonzero(np.diff(time) >= _BREAK * period) + 1
    stretches = tuple(slice(*ends) for ends in pairwise([0, *breaks.tolist(), len(time)]))
    size = float(np.sqrt(np.mean(np.abs(asked) ** 2)))
    return _Velocities(time, seen, asked, period, size, stretches)


def _limit(found: _Velocities, apart: Mask, described: float) -> float | None:
    """The limit [m/s^2], from the way by which ramps fall behind; None with too few.

    A change of velocity D by a ramp of a falls D^2 / (2 a) behind one at once. How the loop swings
    and lags cancels, for it is the same behind both ramps.
    """
    around, slower = round(_AROUND / found.period), []
    for stretch in found.stretches:
        index = np.flatnonzero(apart[stretch]) + stretch.start
        for run in np.split(index, np.flatnonzero(np.diff(index) > around) + 1):
            if not len(run) or run[0] - around < stretch.start or run[-1] + around >= stretch.stop:
                continue
            rows = slice(run[0] - around, run[-1] + around + 1)
            behind = (found.asked - found.seen)[rows]
            change = complex(found.asked[rows][-1] - found.asked[rows][0])
            if abs(change) > _MUCH * found.size:
                way = float((behind * change.conjugate()).real.sum()) * found.period
                slower.append(2.0 * way / abs(change) ** 3)
    if len(slower) < _ENOUGH:
        return None
    inverse = (1.0 / described if described else 0.0) + float(np.median(slower))
    return 1.0 / inverse if inverse > 0.0 else None


def _pace(found: _Velocities, apart: Mask) -> float:
    """The acceleration where too few ramps are whole [m/s^2], of which much is a begin or an end;
    0 where none is known."""
    steps = np.diff(found.time)
    within = apart[1:] & (steps < _BREAK * found.period)
    if not within.any():
        return 0.0
    return float(np.percentile((np.abs(np.diff(found.seen)) / steps)[within], _MOSTLY))


def _ramp(step: float) -> Callable[[complex], complex]:
    """What of a change is done in a sample, by the most that a velocity changes in it [m/s]."""

    def done(change: complex) -> complex:
        length = abs(change)
        return change if length <= step else change * (step / length)

    return done


def _lag(periods: float) -> Callable[[complex], complex]:
    share = 1.0 / (1.0 + periods)
    return lambda change: share * change


def _left(
    fast: Plane, slow: Plane, stretches: Sequence[slice], follow: Callable[[complex], complex]
) -> float:
    """Sum of squares by which one velocity is not what follows the other, from the begin of each
    stretch on."""
    left = 0.0
    for stretch in stretches:
        wanted, there = fast[stretch].tolist(), slow[stretch].tolist()
        now = there[0]
        for goal, seen in zip(wanted[1:], there[1:], strict=True):
            now += follow(goal - now)
            left += abs(now - seen) ** 2
    return left


def _left_late(fast: Plane, slow: Plane, stretches: Sequence[slice], late: float) -> float:
    """As `_left`, by which it is not the other so many samples later."""
    left = 0.0
    for stretch in stretches:
        row = np.arange(stretch.stop - stretch.start)
        shifted = np.interp(row - late, row, fast[stretch])
        left += float(np.sum(np.abs(shifted - slow[stretch]) ** 2))
    return left


def misdescribed_ramp(found: float | None, robot: Robot) -> tuple[str, str]:
    """What is seen where drivers ramp otherwise than described, and what to write; else empty."""
    if found is None:
        return "", ""
    limit = robot.controller.acceleration_limit
    described = f"{limit:g} is described" if limit else "no limit is described"
    return (
        f"the drivers let the velocity change by about {found:.2g} m/s^2, {described}",
        f"write controller.acceleration_limit: {found:.2g}, or have tomr_gap explain find it",
    )
