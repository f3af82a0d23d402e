"""How bad a named fault is: a physical quantity with its interval.

Each quantity is the slope b of a change y on what it is a share of, x, fitted through the origin to
the ticks since the fault was named,

    b = sum x y / sum x^2.

The interval is of 95 %, by the jackknife over stretches of half a second, which the next one hardly
knows of; it is wider by the slope that the same robot showed while it was called well, which is
what its description lacks, or the fault before it was noticed, and by what a description does not
know: its constants to 5 %, the friction of an axle to a tenth. What includes 0 is not told.

Currents follow from powers, P - P_0 = R i^2 + k omega i, the root that drives the wheel.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import (
    BURDENED,
    CONTROL,
    DEGRADED,
    DRAGGING,
    LOW_SUPPLY,
    MOTOR,
    NORMAL,
    POWER_SENSOR,
    SLIP,
    STATES,
    STUCK,
    State,
)
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.effects import EFFECTS
from tomr_power_model.effects.base import Wheel
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Sums = tuple[Array, Array]  # of x^2 and of x y, one for each wheel or one alone

_STRETCH = to_ns(0.5)
_CONSTANTS, _FRICTION = 0.05, 0.1  # what a description does not know of them
_SELDOM = to_ns(0.2)  # between two looks at a robot that is well
_NEXT = to_ns(0.3)  # the longest from one tick to the next
_LEAST = 4  # stretches that an interval needs
_MOST = 60  # stretches that are remembered
_MOVES = 0.5  # rad/s
_DRIVES = 0.05  # m/s
_STANDBY = "electrical.driver_standby"


@frozen
class Severity:
    """A quantity and its interval of 95 %; shares are of 1."""

    quantity: str
    unit: str  # empty: a share
    value: float
    low: float
    high: float

    @property
    def words(self) -> str:
        """As a reader wants it: winding resistance +80 % (+72 to +88 %)."""
        numbers = (self.value, self.low, self.high)
        if not self.unit:
            value, low, high = (f"{100.0 * number:+.0f}" for number in numbers)
            return f"{self.quantity} {value} % ({low} to {high} %)"
        value, low, high = (f"{number:.3g}" for number in numbers)
        return f"{self.quantity} {value} {self.unit} ({low} to {high} {self.unit})"


class Motors:
    """What the measures need to know of a robot."""

    def __init__(self, robot: Robot) -> None:
        wheels = wheel_records(laid_out(vehicle_of(robot)))
        self.constant = wheels[:, at.CONSTANT]  # N m/A at the wheel
        self.resistance = wheels[:, at.RESISTANCE]  # ohm
        standby = robot.physics.get(_STANDBY, (None,) * len(self.constant))
        self.standby = np.array([0.0 if sets is None else sets["power"] for sets in standby])  # W
        self.load, self._viscous = wheels[:, at.LOAD], wheels[:, at.VISCOUS]  # N, N m s/rad
        self._frictions = [_frictions(robot, wheel) for wheel in range(len(self.constant))]
        self._radius = wheels[:, at.NOMINAL_RADIUS]
        self._gear, self._inertia = wheels[:, at.GEAR], wheels[:, at.AXLE_INERTIA]  # kg m^2
        body = Body.of(robot)
        self.to_twist = body.to_twist
        self.to_force = np.linalg.pinv(body.from_force)  # wheel torques to the body's force

    def currents(self, power: Array, speed: Array, way: Array) -> Array:
        """Currents of powers [W] at speeds [rad/s], positive the way that a wheel is driven [A]."""
        back = self.constant * way * speed
        under = back * back + 4.0 * self.resistance * (power - self.standby)
        return np.asarray((np.sqrt(np.maximum(under, 0.0)) - back) / (2.0 * self.resistance))

    def at_floor(self, current: Array, speed: Array, change: Array) -> Array:
        """Forces that wheels hand to the floor [N], of speeds and their change [rad/s^2]."""
        found = []
        for number, (turning, faster) in enumerate(
            zip(speed.tolist(), change.tolist(), strict=True)
        ):
            place = Wheel(
                turning, self.load[number], 0.0, 0.0, self._radius[number], self._gear[number]
            )
            resists = sum(law(*given, place) for law, given in self._frictions[number])
            resists += self._viscous[number] * turning + self._inertia[number] * faster
            torque = self.constant[number] * current[number] - resists
            found.append(torque / self._radius[number])
        return np.array(found)


def _frictions(robot: Robot, wheel: int) -> list[tuple[Callable[..., float], list[float]]]:
    """The laws of what resists a wheel that turns forwards, and their parameters."""
    found = []
    for name, sets in robot.physics.items():
        effect, given = EFFECTS[name], sets[wheel]
        for law in (effect.dry_torque, effect.moving_torque):
            if law is not None and given is not None:
                found.append((law, [given[parameter] for parameter in effect.parameters]))
    return found


@frozen
class Tick:
    """One tick: of each wheel what was measured, what the encoders and the commands explain."""

    stamp_ns: int
    motors: Motors
    speed: Array  # rad/s
    change: Array  # rad/s^2
    expected: Array  # speed that was commanded [rad/s]
    power: Array  # W, or A where that is measured
    from_encoders: Array
    commanded: Array
    are_currents: bool
    supply: float  # voltage over the nominal one

    @classmethod
    def of(cls, motors: Motors, frame: ResidualFrame, last: "Tick | None") -> "Tick | None":
        """None where something is missing; `last`: the tick before."""
        residuals = frame.residuals
        if any(residuals[index].stale for index in (*MOTORS, *SPEEDS, *ENCODERS)):
            return None
        powers = [residuals[index] for index in MOTORS]
        speeds = [residuals[index] for index in SPEEDS]
        speed = np.array([measured_speed(item) for item in speeds])
        change = np.zeros(len(speeds))
        if last is not None and 0 < frame.stamp_ns - last.stamp_ns <= _NEXT:
            change = (speed - last.speed) * (NANOSECONDS / (frame.stamp_ns - last.stamp_ns))
        return cls(
            frame.stamp_ns,
            motors,
            speed,
            change,
            _modelled(speeds),
            _measured(powers),
            _modelled([residuals[index] for index in ENCODERS]),
            _modelled(powers),
            powers[0].unit == "A",
            frame.supply,
        )

    @property
    def way(self) -> Array:
        """In which direction each wheel is driven: as it turns, at rest as it should."""
        turns = np.where(np.abs(self.speed) > _MOVES, self.speed, self.expected)
        return np.asarray(np.where(np.abs(turns) > _MOVES, np.sign(turns), 0.0))

    def current(self, power: Array, speed: Array) -> Array:
        """Of a power, or of what is a current already [A], the way that the wheel is driven."""
        if self.are_currents:
            return power * self.way
        return self.motors.currents(power, speed, self.way)


def _measured(residuals: Sequence[Residual]) -> Array:
    return np.array([item.modelled + item.residual for item in residuals])


def _modelled(residuals: Sequence[Residual]) -> Array:
    return np.array([item.modelled for item in residuals])


def _flags(holds: NDArray[np.bool_]) -> Array:
    return holds.astype(np.float64)


def _friction(tick: Tick) -> Sums:
    """Torque at a wheel that turns, beyond what its motion takes [N m]."""
    more = tick.current(tick.power, tick.speed) - tick.current(tick.from_encoders, tick.speed)
    turns = _flags(np.abs(tick.speed) > _MOVES)
    return turns, turns * tick.motors.constant * more


def _withstood(tick: Tick) -> Sums:
    """Torque of a motor whose wheel should turn [N m]."""
    pushes = _flags(np.abs(tick.expected) > _MOVES)
    return pushes, pushes * tick.motors.constant * tick.current(tick.power, tick.speed)


def _copper(tick: Tick) -> Sums:
    """Losses of a winding beyond those of its current: a share of its resistance."""
    flowing = tick.current(tick.from_encoders, tick.speed)
    losses = tick.motors.resistance * flowing**2 * (np.abs(tick.speed) > _MOVES)
    more = (tick.power - tick.from_encoders) * (0.0 if tick.are_currents else 1.0)
    return losses**2, losses * more


def _scale(tick: Tick) -> Sums:
    """Shown beyond what the encoders explain, as a share."""
    return tick.from_encoders**2, tick.from_encoders * (tick.power - tick.from_encoders)


def _drawn(tick: Tick) -> Sums:
    """Power beyond what the commanded motion takes, as a share."""
    expected = tick.commanded - (0.0 if tick.are_currents else tick.motors.standby)
    return expected**2, expected * (tick.power - tick.commanded)


def _speed(tick: Tick) -> Sums:
    """Wheel speed shown beyond what was commanded, as a share."""
    return tick.expected**2, tick.expected * (tick.speed - tick.expected)


def _traction(tick: Tick) -> Sums:
    """Force over load at the wheels that push hardest: weighted by its cube, as a share."""
    turns = np.abs(tick.speed) > _MOVES
    current = tick.current(tick.power, tick.speed)
    force = (
        np.abs(tick.motors.at_floor(current, tick.way * tick.speed, tick.way * tick.change)) * turns
    )
    return np.array([force**3 @ tick.motors.load]), np.array([force**3 @ force])


def _doubt(motors: Motors) -> float:
    """Of a traction, from the friction at the axles."""
    turning, still = np.ones(len(motors.load)), np.zeros(len(motors.load))
    return float(np.mean(_FRICTION * np.abs(motors.at_floor(still, turning, still)) / motors.load))


def _supply(tick: Tick) -> Sums:
    """Voltage beyond the nominal one, as a share."""
    if tick.supply != tick.supply:
        return np.zeros(1), np.zeros(1)
    return np.ones(1), np.array([tick.supply - 1.0])


def _force(tick: Tick) -> Sums:
    """Force against the way that the robot moves [N]."""
    more = tick.current(tick.power, tick.speed) - tick.current(tick.from_encoders, tick.speed)
    force = tick.motors.to_force @ (tick.motors.constant * more * tick.way)
    velocity = (tick.motors.to_twist @ tick.speed)[:2]
    speed = math.hypot(*velocity)
    if speed < _DRIVES:
        return np.zeros(1), np.zeros(1)
    return np.ones(1), np.array([force[:2] @ velocity / speed])


@frozen
class Measure:
    """A quantity that tells how bad some states are."""

    quantity: str
    unit: str  # empty: a share
    sums: Callable[[Tick], Sums]
    states: tuple[State, ...]
    wheels: int = 3  # 1: of the robot as a whole
    is_absolute: bool = False  # a robot that is well shows it too
    doubt: Callable[[Motors], float] = lambda _: 0.0  # what friction leaves open


MEASURES: tuple[Measure, ...] = (
    Measure("friction added", "N m", _friction, DRAGGING),
    Measure("withstands", "N m", _withstood, STUCK, is_absolute=True),
    Measure("winding resistance, or a loss like it,", "", _copper, DEGRADED),
    Measure("power shown", "", _scale, POWER_SENSOR),
    Measure("motor power", "", _drawn, (STATES[CONTROL],)),
    Measure("wheel speed shown", "", _speed, STATES[MOTOR:]),
    Measure("traction used", "of the load", _traction, (STATES[SLIP],), 1, True, _doubt),
    Measure("resisting force", "N", _force, (BURDENED,), 1),
    Measure("supply voltage", "", _supply, (LOW_SUPPLY,), 1, True),
)


def _places() -> Mapping[State, tuple[Measure, int]]:
    """The measure of each state, and where its first sum stands."""
    found, place = {}, 0
    for measure in MEASURES:
        found.update(dict.fromkeys(measure.states, (measure, place)))
        place += measure.wheels
    return found


@frozen
class Stretches:
    """Sums of some stretches of time, the newest last."""

    squares: deque[Array] = field(factory=lambda: deque(maxlen=_MOST))
    products: deque[Array] = field(factory=lambda: deque(maxlen=_MOST))

    def add(self, squares: Array, products: Array) -> None:
        """Take those of one more."""
        self.squares.append(squares)
        self.products.append(products)

    def clear(self) -> None:
        """Forget all."""
        self.squares.clear()
        self.products.clear()

    def slope(self, place: int) -> tuple[float, float, int]:
        """Slope, its standard error and from how many stretches; 0 of them: not known."""
        x = np.array([squares[place] for squares in self.squares])
        y = np.array([products[place] for products in self.products])
        x, y = x[x > 0.0], y[x > 0.0]
        if len(x) < _LEAST:
            return 0.0, 0.0, 0
        others = (y.sum() - y) / (x.sum() - x)
        scatter = (len(x) - 1.0) / len(x) * float(np.sum((others - others.mean()) ** 2))
        return float(y.sum() / x.sum()), math.sqrt(scatter), len(x)


class SeverityWatch:
    """Follows a robot tick by tick and says how bad what is named is."""

    def __init__(self, robot: Robot) -> None:
        self._motors = Motors(robot)
        self._places = _places()
        self._count = sum(measure.wheels for measure in MEASURES)
        self.clear()

    def clear(self) -> None:
        """Forget all, also how the robot was when it was well."""
        self._well, self._ill = Stretches(), Stretches()
        self._named: tuple[int | None, int | None, str] | None = None
        self._last: Tick | None = None
        self._due = 0  # when a robot that is well is looked at again [ns]
        self._begin(0)

    def _begin(self, stretch: int) -> None:
        self._stretch = stretch
        self._squares, self._products = np.zeros(self._count), np.zeros(self._count)

    def take(self, frame: ResidualFrame, state: State, wheel: int | None) -> None:
        """Take a tick and what is named at it."""
        stretch = frame.stamp_ns // _STRETCH
        named = self._fault_of(state, wheel)
        if stretch != self._stretch or named != self._named:
            self._finish()
            self._begin(stretch)
        if named != self._named:
            self._ill.clear()
            self._named = named
        if named is None and (state is not STATES[NORMAL] or frame.stamp_ns < self._due):
            return
        self._due = frame.stamp_ns + _SELDOM
        tick = self._last = Tick.of(self._motors, frame, self._last)
        if tick is None:
            return
        sums = [measure.sums(tick) for measure in MEASURES]
        self._squares += np.concatenate([squares for squares, _ in sums])
        self._products += np.concatenate([products for _, products in sums])

    def _fault_of(
        self, state: State, wheel: int | None
    ) -> tuple[int | None, int | None, str] | None:
        """What tells one fault from another; what ails a motor may turn out while it lasts."""
        if state not in self._places:
            return None
        return state.paper, wheel, "" if state.paper is not None else state.name

    def _finish(self) -> None:
        if self._squares.any():
            record = self._well if self._named is None else self._ill
            record.add(self._squares, self._products)

    def severity(self, state: State, wheel: int | None) -> Severity | None:
        """Of what is named, or None where there is nothing to tell yet."""
        if state not in self._places:
            return None
        measure, place = self._places[state]
        if measure.wheels > 1:
            if wheel is None:
                return None
            place += wheel
        value, error, count = self._ill.slope(place)
        if not count:
            return None
        well = 0.0 if measure.is_absolute else self._well.slope(place)[0]
        half = _student(count - 1) * error + abs(well) + _CONSTANTS * abs(value)
        half += measure.doubt(self._motors)
        if abs(value) < half:
            return None
        return Severity(measure.quantity, measure.unit, value, value - half, value + half)


def _student(freedom: int) -> float:
    """97.5 % quantile of Student's t, by Cornish and Fisher (0.5 % off at 3 degrees)."""
    z = 1.959964
    return (
        z
        + (z**3 + z) / (4.0 * freedom)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * freedom**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * freedom**3)
    )
