"""The model stage: commands and encoders in, one prediction per tick out."""

import math
from collections import deque
from collections.abc import Sequence
from statistics import median

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.drive.plausible import fastest_wheel
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.readings import NAN, UNKNOWN_READING, SupplyReading
from tomr_power_model.model.command_clock import CommandClock
from tomr_power_model.model.commanded import Commanded, CommandPath, CommandTiming, Seen
from tomr_power_model.model.continuity import COMMAND_TOLERANCE, Continuity
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.encoder_path import RESTS, EncoderPath, Simulated
from tomr_power_model.model.encoders import (
    UNKNOWN,
    UNKNOWN_MOTION,
    EncoderSample,
    EncoderWindow,
    Triple,
    WheelEstimate,
)
from tomr_power_model.model.input_health import InputReporter, InputState, Remark, terms_remark
from tomr_power_model.model.means import Means
from tomr_power_model.model.power_models import POWER_MODELS, MeasuredMotion, Windows
from tomr_power_model.model.prediction import Prediction, Readings
from tomr_power_model.model.resting import RestingDrivers, Voltages
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.model.ticks import Arrival, TickClock, of_tick, to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

COMMANDS = "cmd_vel"
ENCODERS = "joint_states"
IMU = "imu/data"
VOLTAGES = "motor_voltage"

_BY_ANGLE = {"drivetrain.torque_ripple", "sensor.encoder_eccentricity"}
_INTERVALS = 5  # between commands, of which the middle one is usual
_LOST = 1.5  # of the usual: a command was lost
_UNSURE = to_ns(0.5)  # until robot and simulation do the same again
_UNKNOWN: Readings = (UNKNOWN_READING, UNKNOWN_READING, UNKNOWN_READING)


@frozen
class _Tick:
    """What is known of a tick before the drivers are asked about it."""

    estimate: WheelEstimate  # of the motion of the wheels, by their encoders
    simulated: WheelEstimate  # the same as simulated, unknown before the first command
    gyro: float  # rad/s, NaN where not known
    commanded: Commanded | None
    offset_s: float  # how much later than its middle the power was measured [s]
    said: Sequence[float]  # voltages of the drivers, NaN where they do not say them [V]


class PowerPredictor:
    """Streaming core of the power model; driven by stamps, the same online and offline.

    Feed messages as they come, then take the predictions that are `due`. Compiled dynamics give
    the same numbers: worth their start where recordings are read.
    """

    def __init__(
        self, robot: Robot, settings: ModelSettings | None = None, *, is_compiled: bool = False
    ) -> None:
        self.settings = given = settings or ModelSettings()
        self._robot = robot
        self._period_s = period_s = 1e-9 * given.ticks.period
        make = POWER_MODELS[given.power_model].make
        self._model = make(robot, given.model_values, period_s, is_compiled)
        self._clock = TickClock(given.ticks)
        timing = CommandTiming(given.ticks.period, given.command_timeout, given.stale)
        self._path = CommandPath(robot, timing, is_compiled=is_compiled)
        self._resting = RestingDrivers(robot, period_s)
        self._encoders = EncoderWindow(
            given.encoder_window, given.ticks.period, given.stale, fastest_wheel(robot)
        )
        self._commands = Continuity(COMMAND_TOLERANCE)
        self._delay = to_ns(robot.controller.delay)
        self._command_clock = CommandClock(self._delay)
        self._health = InputReporter()
        self._window = to_ns(robot.sensors.power_window)
        self._reads_motor = robot.measurement.quantity == "motor_current"
        numbers = plant_numbers(vehicle_of(robot))
        self._drop, self._cold = numbers.voltage_drop, numbers.initial_rise
        self._flaws = EncoderFlaws.of(robot)
        self._supply_scale = numbers.supply_scale
        self._ripples = bool(_BY_ANGLE & robot.physics.keys())
        self._to_twist = Body.of(robot).to_twist.tolist()
        # The paper's coefficients are fitted to what the monitors showed.
        is_shown = given.power_model != "physical"
        self._measured = EncoderPath(robot, self._model, period_s, is_shown=is_shown)
        self._clear()

    def _clear(self) -> None:
        self._path.clear()
        self._resting.clear()
        self._encoders.clear()
        self._commands.clear()
        self._command_clock.clear()
        self._gyro: deque[tuple[int, float]] = deque()  # stamps [ns], rad/s
        self._voltages: deque[tuple[int, float, float, float]] = deque()
        self._given: tuple[int, Triple] | None = None  # the newest command
        self._intervals: deque[int] = deque(maxlen=_INTERVALS)  # of the commands [ns]
        self._begun: int | None = None  # the first tick, in motion, of which not all is known
        self._losses: deque[int] = deque()  # when commands act [ns] before which one was lost
        self._heading = 0.0  # at the start of the next tick, against the first [rad]
        self._model.clear()
        self._stamps: list[deque[tuple[int]]] = [deque() for _ in range(WHEELS + 1)]
        self._measured.clear()

    def command(self, stamp_ns: int, twist: Triple) -> Arrival:
        """Take a commanded twist (v_x, v_y [m/s], omega_z [rad/s]) in base_link."""
        arrival = self._arrive(COMMANDS, stamp_ns, periodic=False)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._look_for_losses(stamp_ns, twist)
            self._path.command(stamp_ns, twist)
            self._commands.take(stamp_ns + self._delay)  # a pause counts from when it acts on
            self._command_clock.take(stamp_ns, self._clock.sensors)
        else:
            self._commands.ignore(arrival, stamp_ns + self._delay, self._clock.off(COMMANDS))
        return arrival

    def _look_for_losses(self, stamp_ns: int, twist: Triple) -> None:
        """After a lost command robot and simulation were asked for different things a while."""
        if self._given is not None:
            before, same = self._given
            interval, known = stamp_ns - before, self._intervals
            is_late = len(known) == _INTERVALS and interval > _LOST * median(known)
            if is_late and twist != same:
                self._losses.append(stamp_ns + self._delay)
            known.append(interval)
        self._given = stamp_ns, twist

    def _has_lost(self, tick: int) -> bool:
        """Whether a command was lost a moment before a tick."""
        while self._losses and self._losses[0] < tick - _UNSURE:
            self._losses.popleft()
        return bool(self._losses) and self._losses[0] <= tick

    def encoders(self, stamp_ns: int, position: Triple, velocity: Triple) -> Arrival:
        """Take wheel angles [rad] and speeds [rad/s], NaN for what a message lacks."""
        arrival = self._arrive(ENCODERS, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._encoders.add(EncoderSample(stamp_ns, position, velocity))
        elif arrival is Arrival.REPEATED:
            self._encoders.continuity.precedes(stamp_ns)
        return arrival

    def imu(self, stamp_ns: int, yaw_rate: float) -> Arrival:
        """Take a gyro's yaw rate [rad/s], NaN where it says none; it corrects the omega x v terms
        if `use_imu`."""
        arrival = self._arrive(IMU, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED) and not math.isnan(yaw_rate):
            self._gyro.append((stamp_ns, yaw_rate))
        return arrival

    def voltages(self, stamp_ns: int, values: Triple) -> Arrival:
        """Take the voltages that the drivers command [V], positive where they drive forwards."""
        arrival = self._arrive(VOLTAGES, stamp_ns, periodic=False)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._voltages.append((stamp_ns, *values))
        return arrival

    def measured(self, wheel: int, stamp_ns: int) -> Arrival:
        """Take note of when a wheel's power was measured, or, as one more wheel, the whole's."""
        arrival = self._arrive(f"power {wheel}", stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._stamps[wheel].append((stamp_ns,))
        return arrival

    def due(self) -> list[Prediction]:
        """Predictions for the ticks that the stamps have reached, in order."""
        found = []
        for tick in self._clock.due():
            found.append(self._predict(tick))
            states: list[InputState | Remark] = [
                InputState(COMMANDS, self._commands, self._command_clock.ailment(), True)
            ]
            if self._robot.unmodelled:
                states.append(terms_remark(self._path.besides.outside))
            self._health.take(tick, states, self.settings.hardware_id)
        return found

    def reports(self) -> list[DiagnosticMessage]:
        """How the commands come, as far as it is to be said anew; after `due`."""
        return self._health.due()

    def _arrive(self, stream: str, stamp_ns: int, periodic: bool = True) -> Arrival:
        arrival = self._clock.arrive(stream, stamp_ns, periodic)
        if arrival is Arrival.RESTARTED:
            self._clear()
        return arrival

    def _predict(self, tick: int) -> Prediction:
        # What the simulation needs to begin, or to be put where a ripple acts.
        begins = self._path.state is None
        estimate = self._encoders.at(tick) if begins or self._ripples else UNKNOWN_MOTION
        speed, gyro = estimate.speed.tolist(), self._yaw_rate(tick)
        before = self._moved(estimate, -0.5 * self._period_s)
        twist = self._twist(self._flaws.turned(estimate).speed.tolist())
        commanded = self._path.over(tick, Seen(twist, before, self._heading))
        if begins and commanded is not None and _is_half_known(speed):
            self._begun = tick
        simulated = UNKNOWN_MOTION
        if commanded is not None:
            estimate, simulated = self._encoders.beside(tick, self._path.motion)
            speed = estimate.speed.tolist()
        windows = self._windows(tick)
        said = self._said(tick)
        motion, drivers = self._motion(
            _Tick(estimate, simulated, gyro, commanded, windows.offset_s, said)
        )
        is_silent = commanded is None or self._is_silent(tick, commanded, speed)
        if self._has_lost(tick) or is_silent:
            self._resting.forget()
        if commanded is None or is_silent:
            alone = self._readings(self._measured.means(motion, None))
            return Prediction(tick, UNKNOWN, UNKNOWN, _UNKNOWN, UNKNOWN_READING, alone)
        means = self._model.commanded(commanded, windows)
        beside = Simulated(self._moving_as(motion, simulated, drivers.simulated), means)
        return Prediction(
            stamp_ns=tick,
            speed=_triple(commanded.speed),
            torque=_triple(means.torque),
            motors=self._readings(means),
            total=self._total(means),
            from_encoders=self._readings(self._measured.means(motion, beside)),
            voltage=_triple(drivers.simulated),
            held=_triple(_first_known(said, drivers.by_law)),
        )

    def _motion(self, seen: _Tick) -> tuple[MeasuredMotion, Voltages]:
        """Motion of the wheels in a tick, from what the encoders show of it, and the voltages of
        the drivers."""
        drivers = self._resting.voltages(
            self._path,
            self._moved(seen.estimate, 0.5 * self._period_s),
            seen.estimate.speed.tolist(),
            simulated=seen.simulated.speed.tolist(),
            share=0.5 + seen.offset_s / self._period_s,
        )
        wheels = self._flaws.turned(seen.estimate)
        turning = wheels.speed.tolist()
        turned = self._period_s * self._turning(turning, seen.gyro, seen.commanded)
        motion = MeasuredMotion(
            turning,
            wheels.acceleration.tolist(),
            seen.estimate.angle.tolist(),
            seen.gyro,
            self._heading + 0.5 * turned,
            self._path.wheel(at.RISE) or self._cold,
            _first_known(seen.said, drivers.held),
            seen.offset_s,
            self._path.besides,
        )
        self._heading += turned
        return motion, drivers

    def _moving_as(
        self, motion: MeasuredMotion, simulated: WheelEstimate, held: Sequence[float]
    ) -> MeasuredMotion:
        """The same with the wheels and their drivers' voltages as simulated, and the body as they
        roll."""
        wheels = self._flaws.turned(simulated)
        return evolve(
            motion,
            speed=wheels.speed.tolist(),
            acceleration=wheels.acceleration.tolist(),
            yaw_rate=NAN,
            held=held,
        )

    def _said(self, tick: int) -> list[float]:
        """Voltages of the drivers in a tick, as they say [V]; NaN where they do not."""
        period, stale = self.settings.ticks.period, self.settings.stale
        found = of_tick(self._voltages, tick, period, stale)
        if not found:
            return [NAN] * WHEELS
        return [sum(column) / len(found) for column in zip(*found, strict=True)][1:]

    def _is_silent(self, tick: int, commanded: Commanded, speed: Sequence[float]) -> bool:
        """Whether the commands paused lately, so that what the robot was commanded is not known.

        Nor is it known for a moment of a robot that was moving already, nobody knows how.
        After `command_timeout` it was commanded to stop; standing as it should ends the doubt.
        Without a timeout commands may come when they change only, and no silence means anything.
        """
        if self._begun is not None and tick - self._begun < _UNSURE:
            return True
        timeout = self.settings.command_timeout
        if not timeout:
            return False
        silent = self._commands.is_broken(tick)
        stands = all(abs(value) < RESTS for value in (*commanded.speed, *speed))
        if silent and stands and tick - self._commands.last(tick) > timeout:
            self._commands.excuse(tick)
            return False
        return silent

    @staticmethod
    def _moved(estimate: WheelEstimate, seconds: float) -> list[float]:
        """Angles of the wheels some time after the middle of the tick [rad]."""
        speed = estimate.speed + 0.5 * estimate.acceleration * seconds
        found: list[float] = (estimate.angle + seconds * speed).tolist()
        return found

    def _windows(self, tick: int) -> Windows:
        """In which windows the power was measured that a tick compares."""
        period, stale = self.settings.ticks.period, self.settings.stale
        ends = [
            [stamp for (stamp,) in of_tick(stamps, tick, period, stale)] for stamps in self._stamps
        ]
        return Windows(ends[:WHEELS], ends[WHEELS], self._window, tick, period)

    def _twist(self, speed: Sequence[float]) -> Triple:
        """Twist of the body from wheel speeds [rad/s]."""
        rows = self._to_twist
        return _triple([sum([k * w for k, w in zip(row, speed, strict=True)]) for row in rows])

    def _turning(self, speed: Sequence[float], gyro: float, commanded: Commanded | None) -> float:
        """Yaw rate [rad/s]: measured, else as the wheels turn, else as expected, else none."""
        rates = [gyro, self._twist(speed)[2]]
        if commanded is not None:
            rates.append(self._twist(commanded.speed)[2])
        return next((rate for rate in rates if not math.isnan(rate)), 0.0)

    def _yaw_rate(self, tick: int) -> float:
        """The gyro's yaw rate [rad/s], NaN where it is not used or stale."""
        samples = of_tick(self._gyro, tick, self.settings.ticks.period, self.settings.stale)
        return samples[-1][1] if samples and self.settings.use_imu else np.nan

    def _bus_voltage(self, means: Means, power: float) -> float:
        """Supply voltage under a load [V]; sagging to first order where it is not simulated."""
        if means.voltage is not None:
            return means.voltage
        nominal = self._robot.supply.nominal_voltage
        return nominal if math.isnan(power) else nominal - self._drop * power / nominal

    def _readings(self, means: Means) -> Readings:
        if self._reads_motor:
            first, second, third = map(self._at_motor, means.at_motor, means.current)
        else:
            voltage = self._bus_voltage(means, means.total)
            first, second, third = (
                SupplyReading.rounded(voltage, power / voltage) for power in means.power
            )
        return first, second, third

    def _at_motor(self, power: float, current: float) -> SupplyReading:
        """Motor current, and the terminal voltage that makes voltage * current the power."""
        if not self._robot.measurement.signed:
            current = abs(current)
        return SupplyReading.rounded(power / current if current else 0.0, current)

    def _total(self, means: Means) -> SupplyReading:
        if self._reads_motor:
            voltage = self._robot.supply.nominal_voltage
            return SupplyReading.rounded(voltage, sum(means.at_motor) / voltage)
        auxiliary = self._robot.supply.auxiliary_power if means.other is None else means.other
        power = means.total + auxiliary + self._path.besides.supply
        voltage = self._bus_voltage(means, power)
        return SupplyReading.rounded(voltage, self._supply_scale * power / voltage)


def _triple(values: Sequence[float] | Array) -> Triple:
    first, second, third = (float(value) for value in values)
    return first, second, third


def _first_known(first: Sequence[float], other: Sequence[float]) -> list[float]:
    """Of each wheel the first value that is known."""
    return [a if math.isfinite(a) else b for a, b in zip(first, other, strict=True)]


def _is_half_known(speed: Sequence[float]) -> bool:
    """Whether some wheels turn, and of others nothing is known."""
    turns = any(abs(value) > RESTS for value in speed)
    return turns and any(math.isnan(value) for value in speed)
