"""What acts on a robot's body from outside, as its motors show it: a load, or a push.

Three motors hand on three forces, so some force and moment on the body explains any residuals at
all. What really acts from outside shows over seconds: few numbers explain every tick, whichever way
the robot moves, and no wheel alone does,

- a drag D at a hitch h, against the way that the hitch moves, or
- a force and a moment of one direction, in the world or in the body, steady, growing or ceasing.

Who leans on a robot is of the second kind, and not strong. What drags whichever way the robot goes
is nobody, and neither is what pushes with more than a person does for seconds.
"""

from collections import deque

import numpy as np
from attrs import astuple, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.laws import Window
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import MOVES, Tick
from tomr_fault_diag.classifier.slope import shows_motion
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, ResidualFrame
from tomr_power_model.messages.readings import NAN
from tomr_power_model.model.ticks import NANOSECONDS, NEVER, to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_SLOT = to_ns(0.05)  # of faster ticks the first in each is taken
_DIRECTIONS = 8  # in which a hitch may lie ...
_PLACES = (1.0, 2.0)  # ... so many radii of the robot from its centre, or there


@frozen
class OutsideSettings:
    """When something acts from outside; residuals are torques of motors, in bands."""

    windows: tuple[int, ...] = (to_ns(1.5), to_ns(4.0), to_ns(8.0))
    ticks: int = 15  # at least, in a window
    every: int = to_ns(0.2)  # windows are looked at
    holds: int = to_ns(1.0)  # what was found, where the motion changes
    shows: float = 0.5  # bands of some motor, while something acts ...
    quiet: int = to_ns(0.5)  # ... and not for so long when that is over ...
    forget: int = to_ns(3.0)  # ... or hidden for a while, as a cart's drag by a turn on the spot
    far: float = 3.0  # bands: a wheel that turns so far from what it should shows nothing
    mean_square: float = 1.0  # squared bands, of the three motors together
    moving: float = 0.6  # of the ticks, in which every wheel turns
    fit: float = 0.15  # of the sum of squares that an explanation may leave ...
    better: float = 0.3  # ... and of what others leave, that it is better than
    plainly: float = 6.0  # squared bands by which it is, at least
    drag: float = 0.35  # N/kg: no floor drags so much more than another
    person: float = 1.2  # N/kg: more than somebody pushes for seconds, or a steep floor does
    longer: int = to_ns(6.0)  # than a person pushes, where an accelerometer excludes a floor


@frozen
class Outside:
    """What acts on the body."""

    load: bool = False  # something that stays
    push: bool = False  # what a person may do, and no wheel
    may_be_push: bool = False  # the same, for all that the motion has shown
    fits_slope: bool = False  # a force that passes the centre explains it, and so may a wheel
    fits_felt: bool = False  # what an accelerometer feels explains it


NOTHING_ACTS = Outside()
_NEVER_FOUND = (NEVER,) * len(astuple(NOTHING_ACTS))


class OutsideWatch:
    """Follows a robot tick by tick; driven by stamps."""

    def __init__(self, robot: Robot, settings: OutsideSettings | None = None) -> None:
        self.settings = settings or OutsideSettings()
        self._motors = Motors(robot)
        turns = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
        ring = robot.robot_radius * np.column_stack([np.cos(turns), np.sin(turns)])
        self._hitches = np.concatenate([np.zeros((1, 2)), *(far * ring for far in _PLACES)])
        # Magnitudes of currents do not show which way a motor pushes.
        self._is_able = robot.measurement.signed
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._newest = 0  # ns
        self._shown_at = NEVER  # ns, when some motor last showed something
        self._looked_at = NEVER  # ns
        self._found_at = list(_NEVER_FOUND)  # ns, when each of what may be found last was
        self._yaw = 0.0  # rad
        self._ticks: deque[tuple[int, Array, Array, Array, Array, float, float]] = deque()
        self._found = NOTHING_ACTS

    def _forget(self) -> None:
        self._ticks.clear()
        self._found_at, self._found = list(_NEVER_FOUND), NOTHING_ACTS

    def take(self, frame: ResidualFrame) -> Outside:
        """Take a tick."""
        if not self._is_able or frame.stamp_ns // _SLOT == self._newest // _SLOT:
            return self._found
        elapsed, self._newest = frame.stamp_ns - self._newest, frame.stamp_ns
        if _largest(frame) > self.settings.shows:
            self._shown_at = frame.stamp_ns
        silent = frame.stamp_ns - self._shown_at
        if silent > self.settings.forget or elapsed > self.settings.quiet:
            self._forget()
            return NOTHING_ACTS
        with np.errstate(over="ignore", invalid="ignore"):
            self._add(frame, elapsed)
        if self._ticks and frame.stamp_ns - self._ticks[-1][0] > self.settings.quiet:
            self._forget()
        if silent > self.settings.quiet or not self._ticks:
            self._found = NOTHING_ACTS
        elif frame.stamp_ns - self._looked_at >= self.settings.every:
            self._looked_at = frame.stamp_ns
            self._look()
        return self._found

    def _add(self, frame: ResidualFrame, elapsed: int) -> None:
        """Remember a tick in which all is known and wheels turn about as they should."""
        tick = Tick.of(self._motors, frame, None)
        if tick is None or not np.isfinite([tick.speed, tick.power, tick.expected]).all():
            return
        twist = self._motors.to_twist @ tick.speed
        self._yaw += float(twist[2]) * elapsed / NANOSECONDS
        off = max(abs(frame.residuals[k].residual) / frame.residuals[k].band for k in SPEEDS)
        if not off < self.settings.far:
            return
        shown, per_torque = self._torques(tick, follows=off < 1.0)
        felt = np.zeros(WHEELS)
        is_felt = shows_motion(frame)
        if is_felt:  # gravity, or a slide
            felt = self._motors.per_newton @ [*(item.residual for item in frame.along), 0.0]
        bands = np.array([frame.residuals[k].band for k in ENCODERS])
        powers = np.where(np.abs(tick.speed) > MOVES, np.sign(per_torque) / bands, 0.0)
        seen = per_torque * powers
        # In full: what motors show together is lost if that of one is cut.
        both, shown = seen * shown, seen * (shown - felt)
        if np.isfinite([both, shown, seen]).all():
            square = float((both**2).sum()) if is_felt else NAN
            self._ticks.append((frame.stamp_ns, shown, seen, powers, twist, self._yaw, square))
        while self._ticks and self._ticks[0][0] < frame.stamp_ns - self.settings.windows[-1]:
            self._ticks.popleft()

    def _torques(self, tick: Tick, *, follows: bool) -> tuple[Array, Array]:
        """Of the motors beyond what is expected [N m], and what a power is per torque [W/(N m)].

        Encoders are late at times, and commands where wheels do not follow them: of what either
        explains, whatever is nearer.
        """
        motors = self._motors
        more = tick.current - tick.expected_current
        if follows:
            way = np.where(tick.expected < 0.0, -1.0, 1.0)
            other = tick.current - motors.currents(tick.commanded, tick.expected, way)
            more = np.where(np.abs(other) < np.abs(more), other, more)
        least = np.minimum(np.abs(tick.expected_current), np.abs(tick.current))
        current = np.copysign(least, tick.current)
        return motors.constant * more, motors.per_torque(tick.speed, current)

    def _look(self) -> None:
        """Whether the last ticks show something that acts from outside."""
        stamps, *columns = (np.array(column) for column in zip(*self._ticks, strict=True))
        for length in self.settings.windows:
            first = int(np.searchsorted(stamps, self._newest - length))
            if len(stamps) - first >= self.settings.ticks:
                shown, seen, powers, twist, yaw, squares = (column[first:] for column in columns)
                window = Window(shown, seen, powers, twist, yaw, self._motors.per_newton)
                whole = float(squares.sum())  # NaN where not all ticks were felt
                lasts = whole == whole and stamps[-1] - stamps[first] >= self.settings.longer
                found = self._judge(window, whole, lasts=lasts)
                for place, is_so in enumerate(astuple(found)):
                    self._found_at[place] = self._newest if is_so else self._found_at[place]
            if first == 0:
                break
        self._found = Outside(*(self._newest - at <= self.settings.holds for at in self._found_at))

    def _judge(self, window: Window, whole: float, *, lasts: bool) -> Outside:
        """What acts in a window beyond what an accelerometer feels; `whole`: sum of squares with
        that, NaN where none is heard; `lasts`: for longer than a person pushes."""
        s, total = self.settings, window.sum_of_squares
        least = s.mean_square * len(window.shown)
        fits_felt = whole > least and total < s.fit * whole
        if total < least:
            return Outside(fits_felt=fits_felt)
        lone, torques = window.left_by_encoder(self._motors.to_twist), window.left_by_torques()
        drivers = window.left_by_power()

        def explains(left: float, *others: float) -> bool:
            return left < s.fit * total and all(
                left < min(s.better * other, other - s.plainly) for other in others
            )

        pushed, force = window.left_by_push()
        dragged, drag = window.left_by_drag(self._hitches)
        if drag > s.drag and explains(dragged, lone, torques, drivers, pushed):
            return Outside(load=True, fits_felt=fits_felt)
        may_be = explains(pushed, lone)
        sloping, pull = window.left_by_push(turns=False)
        # Where a wheel stands two residuals are left, which some force always explains.
        is_tried = may_be and window.moving > s.moving
        is_strong = force > (s.drag if lasts else s.person)
        return Outside(
            load=is_tried and is_strong,
            push=is_tried and not is_strong,
            may_be_push=may_be and not is_strong,
            fits_slope=explains(sloping) and pull < s.person,
            fits_felt=fits_felt,
        )


def _largest(frame: ResidualFrame) -> float:
    """Of the motors' residuals, of each the smaller of its two [bands]."""
    either = (
        (frame.residuals[encoder], frame.residuals[motor])
        for encoder, motor in zip(ENCODERS, MOTORS, strict=True)
    )
    return max(min(abs(item.residual) / item.band for item in pair) for pair in either)
