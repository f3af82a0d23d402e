"""Small faults that last: what a robot's own bands hide, and one wheel shows again and again.

Residuals of a commissioned robot scatter by a fifth of their bands, around nothing. A bearing that
drags a little, windings that lose more, or a power sensor whose scale is off moves those of one
wheel by no more than that, too little for a window of 0.4 s, but for as long as the wheel turns. Of
each such fault the size theta is fitted to the last seconds,

    r = theta phi + noise

of the residuals of its power P and of its driver's voltage, where

    a bearing drags         phi: (omega + 2 R i / k) tau,  R tau / k,       tau: the axle's friction
    a winding loses more         R i^2,                    R i
    a magnet is weak             2 R i^2,                  R i - k omega
    a power sensor is off        P,                        0

(tau / k, 0, i and i in place of the powers where currents are measured), and how much better than
nothing it predicts the next tick is evidence, which the belief gathers. No more counts than is left

- by a force on the body, which is shared out among the wheels, sudden, or of a slope,
- by the total power, which tells a motor that draws more from a sensor that shows more,
- of what the other wheels show as well, as on a carpet, and of what came within minutes, as heat,
- by what a load has left in the drivers' sums.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import DRAGS, HYPOTHESES, METERS, WEAKS
from tomr_fault_diag.classifier.driver_sums import DriverSums
from tomr_fault_diag.classifier.forces import SteadyForce, by_sudden_force
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import MOVES
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    TOTAL,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]


@frozen
class SmallFault:
    """A fault of a wheel, and the sizes theta of it: shares of what `_effects` has for it."""

    hypotheses: slice
    typical: float
    negligible: float  # no fault: a description does not know it better
    is_signed: bool = False  # it may be less, too
    in_total: bool = True  # the total power shows it as well


FAULTS = (
    SmallFault(DRAGS, 1.0, 0.2),  # of the axle's friction
    SmallFault(WEAKS, 1.0, 0.1),  # of the winding's resistance
    SmallFault(WEAKS, 0.3, 0.05),  # of the torque constant
    SmallFault(METERS, 0.3, 0.08, is_signed=True, in_total=False),  # of the power shown
)
_COUNT = len(FAULTS)
_MOTOR = [index for index, fault in enumerate(FAULTS) if fault.hypotheses == WEAKS]
_TYPICAL = np.array([fault.typical for fault in FAULTS])[:, None, None]
_NEGLIGIBLE = np.array([fault.negligible for fault in FAULTS])[:, None, None]
_SIGNED = np.array([fault.is_signed for fault in FAULTS])[:, None]
_IN_TOTAL = np.array([1.0 if fault.in_total else -1.0 for fault in FAULTS])[:, None]
_OTHERS = np.array([[1, 2], [0, 2], [0, 1]])  # wheels beside each
_SPEED = 5.0  # rad/s, at which an axle's friction is taken
_BEYOND = 1e3  # bands, that no fault or force of a typical size is
_SLOT = to_ns(0.05)  # of faster ticks the first in each is taken


@frozen
class LastingSettings:
    """What residuals of a healthy robot may do, and how much a small fault must."""

    memory: int = to_ns(1.5)  # over which a size is fitted
    long: int = to_ns(10.0)  # and over which sizes of all faults are, that are no fault ...
    slowly: int = to_ns(60.0)  # ... where they came within so long ...
    most_slow: float = 0.5  # bands: ... and add no more
    scatter: float = 0.2  # bands: 3.3 standard deviations of noise, and half as much again
    total_scatter: float = 0.25  # bands of the total power
    # Bands by which a healthy robot's residuals of power, and of voltage, may lie off nothing: what
    # came into a driver's sum and is not known stays there for seconds, and may be anything.
    little: tuple[float, float] = (0.08, 0.6)
    clip: tuple[float, float] = (6.0, 20.0)  # bands of power, of voltage: more counts no more
    forces: tuple[float, ...] = (0.1, 0.3, 1.0)  # N/kg, deviations of a force on the body
    steady: float = 1.0  # N/kg, deviation of one that stays
    alike: float = 0.5  # by which a fault and such a force explain the same
    lever: float = 0.3  # of the robot's radius, at which it acts
    worth: float = 6.0  # that a tick counts: most robots scatter less
    most: float = 2.0  # that it says
    least: float = -0.2  # a fault may be none of these, and large
    against: float = -3.0  # that its total power says
    # After a wheel has turned so far off, by what a share of the supply's voltage amounts to, its
    # driver may not have obeyed its law: as long the voltage says nothing.
    far: float = 0.25
    doubt: int = to_ns(10.0)
    strange: float = 0.5  # of that, after which nothing is said for ...
    pause: int = to_ns(0.5)  # ... so long


class LastingWatch:
    """Follows a commissioned robot tick by tick; driven by stamps."""

    def __init__(self, robot: Robot, settings: LastingSettings | None = None) -> None:
        self.settings = settings or LastingSettings()
        self._motors = motors = Motors(robot)
        self._friction = motors.friction(_SPEED)
        per_speed = robot.controller.proportional + motors.constant
        self._far = self.settings.far * robot.supply.nominal_voltage / per_speed  # rad/s
        lever = self.settings.lever * robot.robot_radius
        self._shares = motors.mass * motors.from_force * np.array([1.0, 1.0, lever])
        s = self.settings
        self._steady = SteadyForce(s.memory, s.steady, s.scatter)
        self._sums = DriverSums()
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._newest = 0  # ns
        self._resumes = 0  # ns
        self._doubted = np.zeros(WHEELS, dtype=np.int64)  # ns, until when voltages are
        self._said = np.zeros(HYPOTHESES)
        self._steady.clear()
        self._sums.clear()
        # Sums of phi^2 and phi r, (4, 3): faults and wheels; and of all faults at each wheel.
        self._squares = np.zeros((_COUNT, WHEELS))
        self._products = np.zeros((_COUNT, WHEELS))
        self._normal = np.zeros((WHEELS, _COUNT, _COUNT))
        self._right = np.zeros((WHEELS, _COUNT))
        self._slow = np.zeros((WHEELS, _COUNT))  # sizes that came slowly

    def take(self, frame: ResidualFrame, is_well: bool) -> Array:
        """Log-likelihoods (19,) of faults over a healthy robot's, from the newest tick.

        `is_well`: nothing is named, and what comes slowly is learnt.
        """
        if frame.stamp_ns // _SLOT == self._newest // _SLOT:
            return self._said
        elapsed, self._newest = frame.stamp_ns - self._newest, frame.stamp_ns
        self._said = np.zeros(HYPOTHESES)
        off = np.abs([item.residual for item in _of(frame, SPEEDS)])
        self._doubted[off > self._far] = frame.stamp_ns + self.settings.doubt
        if (off > self.settings.strange * self._far).any():
            self._resumes = frame.stamp_ns + self.settings.pause
        if frame.stamp_ns < self._resumes:
            return self._said
        with np.errstate(over="ignore", invalid="ignore"):
            effects, shared = self._effects(frame)
        shown = self._shown(frame, effects)
        # False where something is not known.
        if not all((np.abs(part) < _BEYOND).all() for part in (shown, effects, shared)):
            return self._said
        sudden = shown - self._came_slowly(effects)
        if is_well:
            self._learn_slowly(shown, effects, elapsed)
        turning = float(self._motors.to_twist[2] @ [measured_speed(i) for i in _of(frame, SPEEDS)])
        steady = self._steady.take(sudden.T.ravel(), shared, elapsed, turning)
        found = self._predicted(sudden, effects, shared, steady, frame)
        self._learn(sudden, effects, elapsed)
        volts, shows = sudden[:, 1], np.asarray(effects[:, :, 1].any(axis=0))
        self._sums.take(volts * _voltage_bands(frame), np.abs(volts) > 1.0, shows, elapsed)
        said = np.full(HYPOTHESES, -np.inf)
        for fault, row in zip(FAULTS, self.settings.worth * found, strict=True):
            said[fault.hypotheses] = np.maximum(said[fault.hypotheses], row)
        self._said = np.where(np.isinf(said), 0.0, said)
        return self._said

    def _effects(self, frame: ResidualFrame) -> tuple[Array, Array]:
        """What each fault of its typical size adds to each wheel's residuals of power and voltage
        [bands], (4, 3, 2), and what forces along and across of 1 N/kg and their moment do to all
        powers, then voltages, (6, 3); 0 where it stands."""
        motors, derived = self._motors, _of(frame, ENCODERS)
        speed = np.array([measured_speed(item) for item in _of(frame, SPEEDS)])
        power = np.array([item.modelled for item in derived])
        way = np.where(speed < 0.0, -1.0, 1.0)
        current = motors.currents(power, speed, way)
        per_torque, drop = motors.per_torque(speed, current), motors.resistance * current
        loss, weak = drop * current, 2.0 * drop * current
        if motors.reports_currents:
            loss, weak = np.zeros(WHEELS), power
            if not motors.reports_signs:
                per_torque = way * per_torque
        volts = motors.resistance / motors.constant  # V/(N m)
        bands = np.array([[item.band for item in part] for part in (derived, frame.voltages)])
        is_known = [not item.stale for item in frame.voltages] & (frame.stamp_ns > self._doubted)
        known = np.array([[True] * WHEELS, is_known])
        moves = np.where(known, (np.abs(speed) > MOVES) / bands, 0.0)  # (2, 3)
        drags, friction = np.array([per_torque, volts]) * moves, way * self._friction
        effects = np.array(
            [
                friction * drags,
                np.array([loss, drop]) * moves,
                np.array([weak * is_known, drop - motors.constant * speed]) * moves,
                np.array([power, np.zeros(WHEELS)]) * moves,
            ]
        )
        shared = drags[:, :, None] * self._shares
        return _TYPICAL * effects.transpose(0, 2, 1), shared.reshape(-1, 3)

    def _shown(self, frame: ResidualFrame, effects: Array) -> Array:
        """Residuals of power and voltage of each motor [bands], (3, 2): of its two powers the
        smaller, for either is late at times; 0 for a voltage that shows no fault."""
        by_encoder, by_command, volts = (
            np.array([item.residual / item.band for item in items])
            for items in (_of(frame, ENCODERS), _of(frame, MOTORS), frame.voltages)
        )
        is_smaller = np.abs(by_command) < np.abs(by_encoder)  # not where it is NaN
        power = np.where(is_smaller, by_command, by_encoder)
        shows = effects[:, :, 1].any(axis=0)
        shown = np.stack([power, np.where(shows, volts, 0.0)], axis=1)
        most = (np.abs(shown) / self.settings.clip).max(axis=1, keepdims=True)
        over = np.maximum(most, 1.0)
        return np.asarray(shown / over)  # both less alike: which fault it is depends on both

    def _predicted(
        self, sudden: Array, effects: Array, shared: Array, steady: float, frame: ResidualFrame
    ) -> Array:
        """How much better each fault predicts a tick than nothing does, or a force on the body,
        and what the total power leaves of it, (4, 3)."""
        s = self.settings
        size = self._products / (self._squares + s.scatter**2)
        size = _beyond_others(np.where(_SIGNED, size, np.maximum(size, 0.0)))
        mean = size[:, :, None] * effects
        little = np.maximum(_NEGLIGIBLE / _TYPICAL * np.abs(effects), s.little)
        stays = self._sums.stays / _voltage_bands(frame)
        around = np.stack(np.broadcast_arrays(np.zeros((_COUNT, 1)), stays), 2)
        explained = np.stack(np.broadcast_arrays(mean[:, :, 0], sudden[:, 1]), 2)
        little = np.clip(explained, around - little, around + little)
        none = _better(sudden, np.zeros(1), little, s.scatter)
        none += by_sudden_force(_left(sudden, little), shared, s.forces, s.scatter)
        # Nor does a description know the winding and the magnet of a motor, which voltages show.
        motor = np.where(effects[_MOTOR, :, 1].any(axis=0), none[_MOTOR].max(axis=0), -np.inf)
        found = _better(sudden, np.zeros(1), mean, s.scatter) - np.maximum(none, motor)
        beyond = _better(sudden, np.zeros(1), mean, s.scatter) - steady
        beyond = np.sign(beyond) * np.maximum(np.abs(beyond) - s.alike, 0.0)
        found = np.minimum(found, beyond)
        # By as much as the best explains a wheel better than another fault does, it is likelier.
        over = np.maximum(found.max(axis=0) - s.most, 0.0)
        return np.asarray(np.maximum(found - over + self._against(mean[:, :, 0], frame), s.least))

    def _against(self, mean: Array, frame: ResidualFrame) -> Array:
        """What the total power says against motors that draw so much more [bands], (3, 3), and
        against sensors that only show it, (3,)."""
        total = frame.residuals[TOTAL]
        if total.stale:
            return np.zeros_like(mean)
        s, bands = self.settings, np.array([item.band for item in _of(frame, ENCODERS)])
        drawn = np.clip(np.full(WHEELS, total.residual / total.band), -s.clip[0], s.clip[0])
        added = (mean * bands / total.band)[:, :, None]
        shows = _better(drawn[:, None], np.zeros(1), added, s.total_scatter)
        return np.asarray(np.clip(_IN_TOTAL * shows, s.against, 0.0))

    def _learn(self, shown: Array, effects: Array, elapsed: int) -> None:
        kept = np.exp(-elapsed / self.settings.memory)
        self._squares = kept * self._squares + (effects**2).sum(axis=2)
        self._products = kept * self._products + (effects * shown).sum(axis=2)

    def _came_slowly(self, effects: Array) -> Array:
        """What that adds to each wheel's residuals [bands], (3, 2)."""
        s = self.settings
        added = (effects * self._slow.T[:, :, None]).sum(axis=0)
        return np.asarray(np.clip(added, -s.most_slow, s.most_slow))

    def _learn_slowly(self, shown: Array, effects: Array, elapsed: int) -> None:
        if not effects.any():
            return
        kept = np.exp(-elapsed / self.settings.long)
        at_wheels = effects.transpose(1, 0, 2)  # (3, 4, 2)
        self._normal = kept * self._normal + at_wheels @ at_wheels.transpose(0, 2, 1)
        self._right = kept * self._right + (at_wheels @ shown[:, :, None])[:, :, 0]
        prior = self.settings.scatter**2 * np.eye(_COUNT)
        sizes = np.linalg.solve(self._normal + prior, self._right[:, :, None])[:, :, 0]
        self._slow += min(elapsed, NANOSECONDS) / self.settings.slowly * (sizes - self._slow)


def _of(frame: ResidualFrame, channels: range) -> list[Residual]:
    return [frame.residuals[index] for index in channels]


def _voltage_bands(frame: ResidualFrame) -> Array:
    """In V, (3,); 1 where a voltage is not known, which shows nothing."""
    return np.nan_to_num([item.band for item in frame.voltages], nan=1.0)


def _beyond_others(size: Array) -> Array:
    """How far each wheel's sizes, (faults, 3), go beyond what another wheel shows as well."""
    others = size[:, _OTHERS]  # (faults, wheels, 2)
    up = np.maximum(size - np.maximum(others.max(axis=2), 0.0), 0.0)
    down = np.minimum(size - np.minimum(others.min(axis=2), 0.0), 0.0)
    return np.asarray(np.where(size > 0.0, up, down))


def _left(shown: Array, little: Array) -> Array:
    """What is shown (wheels, channels) beyond a little of each fault (faults, wheels, channels) of
    each wheel: of all powers, then voltages, (faults, wheels, 6)."""
    own = np.eye(WHEELS)[:, :, None] * little[:, :, None, :]  # (faults, wheels, wheels, channels)
    return np.swapaxes(shown - own, -1, -2).reshape(*little.shape[:2], -1)


def _better(shown: Array, nothing: Array, mean: Array, scatter: float) -> Array:
    """Log-likelihood of one mean over that of another, (faults, wheels), of what all channels show,
    (faults, wheels, channels)."""
    better = ((shown - nothing) ** 2 - (shown - mean) ** 2) / (2.0 * scatter**2)
    return np.asarray(better.sum(axis=2))
