"""The power models to choose from, by name: the parameter `power_model`."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from attrs import frozen

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled, plain
from tomr_power_model.dynamics.drives import PowerModel, WheelMotion
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.simulation import as_list
from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.model.commanded import Commanded
from tomr_power_model.model.means import Means
from tomr_power_model.model.trace import Monitor, Trace, Value
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.unmodelled.online import NOTHING, Besides
from tomr_power_model.wang2024 import WANG2024_PARAMETERS, Coefficients, Wang2024Model

_PARTS = 10  # of a tick, where torque ripples with the wheels' angles
_KEPT = 600_000_000  # ns, of simulated steps
# Columns of the simulated steps, of the first wheel.
_UNKNOWN = [math.nan] * WHEELS
_POWER, _CURRENT, _AT_MOTOR, _TOTAL = 0, WHEELS, 2 * WHEELS, 3 * WHEELS


@frozen
class Windows:
    """When the power of a tick was measured, or shall be known; all in nanoseconds."""

    ends: Sequence[Sequence[int]]  # of the windows of each wheel's samples
    total: Sequence[int]  # of those of the whole robot
    length: int  # of each window; of a tick without samples it is the tick itself
    tick: int
    period: int  # of the ticks

    def of(self, wheel: int) -> tuple[Sequence[int], int]:
        """Ends and length of a wheel's windows."""
        ends = self.ends[wheel]
        return (ends, self.length) if ends else ((self.tick,), self.period)

    def of_total(self) -> tuple[Sequence[int], int]:
        """Ends and length of the whole robot's windows."""
        return (self.total, self.length) if self.total else ((self.tick,), self.period)

    @property
    def offset_s(self) -> float:
        """How much later than the tick's middle the wheels' windows lie on the whole [s]."""
        middles = [end - length // 2 for end, length in self._all()]
        return 1e-9 * (sum(middles) / len(middles) - self.tick + self.period // 2)

    def _all(self) -> list[tuple[int, int]]:
        found = [self.of(wheel) for wheel in range(len(self.ends))]
        return [(end, length) for ends, length in found for end in ends]


@frozen
class MeasuredMotion:
    """Motion of the wheels at the middle of a tick, and what else the encoder path needs."""

    speed: Sequence[float]  # rad/s
    acceleration: Sequence[float]  # rad/s^2
    angle: Sequence[float]  # rad, NaN where not known
    yaw_rate: float  # of a gyro [rad/s]; NaN: as the wheels say
    heading: float  # rad
    rise: Sequence[float]  # of the windings above 25 C [K]
    held: Sequence[float]  # voltage of a driver whose wheel is at rest [V]; NaN: not known
    offset: float = 0.0  # how much later than the middle the power was measured [s]
    besides: Besides = NOTHING  # what learnt terms do


class TickPower(Protocol):
    """A power model as the predictor asks it, tick by tick."""

    def commanded(self, motion: Commanded, windows: Windows) -> Means:
        """Power in the motion that the commands lead to, in some windows."""
        ...

    def measured(self, motion: MeasuredMotion) -> Means:
        """Power in the motion that the encoders show."""
        ...

    def clear(self) -> None:
        """Forget what was."""
        ...


Maker = Callable[[Robot, Mapping[str, object], float, bool], TickPower]


@frozen
class Kind:
    """A power model: how it is made, and the parameters that are its own."""

    make: Maker
    parameters: tuple[ParameterSpec, ...] = ()


POWER_MODELS: dict[str, Kind] = {}


def power_model(name: str, *parameters: ParameterSpec) -> Callable[[Maker], Maker]:
    """Register a maker of a power model; it gets the robot, checked parameters, a tick [s]
    and whether to compile."""

    def register(make: Maker) -> Maker:
        POWER_MODELS[name] = Kind(make, parameters)
        return make

    return register


def own_parameters() -> tuple[ParameterSpec, ...]:
    """The parameters of all power models."""
    return tuple(spec for kind in POWER_MODELS.values() for spec in kind.parameters)


class Physical:
    """Our dynamics: the simulation's own power, and inverse dynamics of the encoders."""

    def __init__(self, robot: Robot, period_s: float, is_compiled: bool) -> None:
        made: Callable[[list[float]], Any] = np.array if is_compiled else list
        self._made, self._numbers = made, made(laid_out(vehicle_of(robot)).tolist())
        self._step = compiled() if is_compiled else plain(tuple(robot.physics))
        parts = _PARTS if "drivetrain.torque_ripple" in robot.physics else 1
        self._instants = [period_s * ((k + 0.5) / parts - 0.5) for k in range(parts)]
        self._constant = [motor.wheel_constant for motor in robot.motors]
        self._reads_motor = robot.measurement.quantity == "motor_current"
        numbers = plant_numbers(vehicle_of(robot))
        self._nominal = robot.supply.nominal_voltage
        self._monitors = [Monitor(numbers, wheel) for wheel in range(WHEELS)]
        late = max(abs(monitor.delay) for monitor in self._monitors)
        self._trace = Trace(_KEPT + late)

    def clear(self) -> None:
        """Forget what was simulated."""
        self._trace.clear()
        for monitor in self._monitors:
            monitor.clear()

    def commanded(self, motion: Commanded, windows: Windows) -> Means:
        """As simulated, and as the monitors show it, in the windows in which they measure."""
        for start, row in zip(motion.starts, motion.rows, strict=True):
            self._trace.add(start, motion.length, self._columns(motion, row))
        ends, length = windows.of_total()
        total = _mean([self._trace.mean(_TOTAL, end, length) for end in ends])

        def read(column: int) -> list[float]:
            return [self._read(column, wheel, windows) for wheel in range(WHEELS)]

        shown = [monitor.shown for monitor in self._monitors]
        current = at_motor = power = _UNKNOWN
        if self._reads_motor:  # monitors take the current for that of the supply
            volts, flows = self._nominal, read(_CURRENT)
            current = [show(volts * i) / volts for show, i in zip(shown, flows, strict=True)]
            at_motor = [
                p * seen / true if true else p
                for p, true, seen in zip(read(_AT_MOTOR), flows, current, strict=True)
            ]
        else:
            power = [show(p) for show, p in zip(shown, read(_POWER), strict=True)]
        return Means(motion.torque, current, at_motor, power, None, motion.voltage, total)

    def _read(self, column: int, wheel: int, windows: Windows) -> float:
        ends, length = windows.of(wheel)
        delay, column = self._monitors[wheel].delay, column + wheel
        return _mean([self._trace.mean(column, end - delay, length) for end in ends])

    def _columns(self, motion: Commanded, row: Sequence[float]) -> list[Value]:
        """Power as the monitors see it, current, power at the motor, and the whole power."""
        speeds, currents = motion.wheels(row, at.OUT_SPEED), motion.wheels(row, at.OUT_CURRENT)
        power, tilt = motion.wheels(row, at.OUT_POWER), motion.wheels(row, at.OUT_TILT)
        copper = motion.wheels(row, at.OUT_COPPER)
        duration = 1e-9 * motion.length
        seen: list[Value] = []
        for wheel, monitor in enumerate(self._monitors):
            own = (currents[wheel], 0.0) if self._reads_motor else (power[wheel], tilt[wheel])
            seen.append(monitor.follow(own, duration))
        drawn = [(p, t) for p, t in zip(power, tilt, strict=True)] if self._reads_motor else seen
        flowing = seen if self._reads_motor else [(current, 0.0) for current in currents]
        work = [
            (k * w * i + loss, 0.0)
            for k, w, i, loss in zip(self._constant, speeds, currents, copper, strict=True)
        ]
        return [*drawn, *flowing, *work, (sum(power), sum(tilt))]

    def measured(self, motion: MeasuredMotion) -> Means:
        """As inverse dynamics compute, mean over the parts of the tick."""
        sums = tuple([0.0] * WHEELS for _ in range(4))
        obeyed = [True] * WHEELS
        share = 1.0 / len(self._instants)
        for instant in self._instants:
            for wheel, found in enumerate(self._at(motion, instant + motion.offset)):
                values = found[0], found[1], found[2] * found[1], found[3]
                for total, value in zip(sums, values, strict=True):
                    total[wheel] += share * value
                obeyed[wheel] = obeyed[wheel] and found[at.POWER_OBEYED] > 0.0
        torque, current, at_motor, power = sums
        return Means(torque, current, at_motor, power, obeyed=obeyed)

    def _at(self, motion: MeasuredMotion, instant: float) -> list[list[float]]:
        """What `drive_power` says of each drive, `instant` after the middle [s]."""
        row = [motion.yaw_rate, motion.heading]
        for wheel in range(WHEELS):
            speed, change = motion.speed[wheel], motion.acceleration[wheel]
            angle = motion.angle[wheel] + instant * (speed + 0.5 * change * instant)
            rise, held = motion.rise[wheel], motion.held[wheel]
            resisting = motion.besides.torque[wheel]
            row += [speed + change * instant, change, angle, resisting, rise, held]
        found = self._made([0.0] * (WHEELS * at.POWER_WHEEL))
        self._step.drive_power(self._numbers, self._made(row), found, WHEELS)
        out = as_list(found)
        for wheel, power in enumerate(motion.besides.driver):
            out[wheel * at.POWER_WHEEL + at.POWER_DRAWN] += power
        size = at.POWER_WHEEL
        return [out[first : first + size] for first in range(0, len(out), size)]


class FromMotion:
    """A model that knows of motion alone: both paths ask it about theirs."""

    def __init__(self, model: PowerModel, step_s: float) -> None:
        self._model = model
        self._step = step_s
        self.clear()

    def clear(self) -> None:
        """Forget the last step."""
        self._last = Means(_UNKNOWN, _UNKNOWN, _UNKNOWN, _UNKNOWN)

    def commanded(self, motion: Commanded, windows: Windows) -> Means:
        """Mean over the steps of the tick; as in the last step where none ended in it."""
        if not motion.rows:
            return self._last
        speed = np.array([motion.wheels(row, at.OUT_SPEED) for row in motion.rows])
        change = np.empty_like(speed)
        edge = np.array(motion.edge)
        for row, mean in enumerate(speed):
            change[row] = 2.0 * (mean - edge) / self._step
            edge = 2.0 * mean - edge
        self._last = Means.of(self._model.power(WheelMotion(speed, change)))
        return self._last

    def measured(self, motion: MeasuredMotion) -> Means:
        """At the middle of the tick."""
        yaw = None if math.isnan(motion.yaw_rate) else np.array([motion.yaw_rate])
        speed, change = np.array([motion.speed]), np.array([motion.acceleration])
        return Means.of(self._model.power(WheelMotion(speed, change, yaw)))


@power_model("physical")
def physical(
    robot: Robot, values: Mapping[str, object], period_s: float, is_compiled: bool
) -> TickPower:
    """The dynamics with the effects of robot.yaml."""
    return Physical(robot, period_s, is_compiled)


@power_model("wang2024", *WANG2024_PARAMETERS)
def wang2024(
    robot: Robot, values: Mapping[str, object], period_s: float, is_compiled: bool
) -> TickPower:
    """The paper's energy model, with coefficients fitted to a healthy drive."""
    model = Wang2024Model.of(robot, Coefficients.of(values))
    step = laid_out(vehicle_of(robot))[at.STEP]
    return FromMotion(model, float(step))


def _mean(values: Sequence[float]) -> float:
    """Mean of what is known."""
    known = [value for value in values if value == value]
    return sum(known) / len(known) if known else math.nan
