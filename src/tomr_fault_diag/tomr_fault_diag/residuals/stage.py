"""The residual stage: predictions and measurements in, a frame of residuals per tick out."""

import math
from collections import deque
from typing import Self

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.description import DescriptionWatch
from tomr_fault_diag.residuals.frame import (
    BAND_SIGMAS,
    FROZEN,
    GAP,
    MOTORS,
    NO_COMMAND,
    NO_ENCODERS,
    NO_FRESH,
    NOT_MEASURED,
    SCATTER,
    Residual,
    ResidualFrame,
    Unit,
    rounded,
)
from tomr_fault_diag.residuals.inertial import IMU, InertialWatch
from tomr_fault_diag.residuals.measured import Measured, SupplyWindow
from tomr_fault_diag.residuals.scatter import ScatterWatch
from tomr_fault_diag.residuals.settings import BandSettings, ResidualSettings
from tomr_fault_diag.residuals.slow_encoders import ExpectedMotion
from tomr_fault_diag.residuals.voltages import VoltageWatch
from tomr_fault_diag.residuals.widths import transient_ticks, width
from tomr_power_model.drive.plausible import IGNORED, PowerLimits, fastest_wheel
from tomr_power_model.drive.sources import (
    ARRAY_TOPIC,
    TOTAL,
    TOTAL_TOPIC,
    PowerReading,
    motor_topics,
)
from tomr_power_model.dynamics.body import Body
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.readings import NAN, UNKNOWN_READING
from tomr_power_model.model.continuity import POWER_TOLERANCE, Continuity
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.encoders import (
    UNKNOWN,
    EncoderSample,
    EncoderWindow,
    Triple,
    WheelEstimate,
)
from tomr_power_model.model.input_health import InputReporter, InputState, Remark
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.repeats import RepeatWatch, Work
from tomr_power_model.model.ticks import Arrival, TickClock
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

PREDICTIONS = "predictions"
ENCODERS = "joint_states"

_NO_PREDICTION = "no prediction: power_model does not run, or waits for what it reads"
_TOO_FAST = "by robot.yaml no wheel can turn so far so fast (rad of the wheel, not of its motor)"
_UNSURE = 1.0  # bands: a speed is not known whose standard deviation is larger
_TURNS = 0.3  # rad/s: a slower wheel may rest

_UNKNOWN_READINGS = (UNKNOWN_READING, UNKNOWN_READING, UNKNOWN_READING)


@frozen
class _Modelled:
    """What is compared of a prediction: of motors 1-3, of the total, of motors from encoders."""

    speed: Triple  # rad/s
    power: tuple[float, ...]  # W
    drawn: tuple[float, ...]  # A

    @classmethod
    def of(cls, prediction: Prediction) -> Self:
        readings = (*prediction.motors, prediction.total, *prediction.from_encoders)
        power = tuple([reading.power for reading in readings])
        return cls(prediction.speed, power, tuple([r.drawn_current for r in readings]))

    def of_unit(self, unit: Unit) -> tuple[float, ...]:
        return self.power if unit == "W" else self.drawn


def _no_prediction(stamp_ns: int) -> Prediction:
    return Prediction(
        stamp_ns, UNKNOWN, UNKNOWN, _UNKNOWN_READINGS, UNKNOWN_READING, _UNKNOWN_READINGS
    )


class ResidualStage:
    """Streaming core of the residuals; driven by stamps, the same online and offline."""

    def __init__(self, robot: Robot, settings: ResidualSettings | None = None) -> None:
        self.settings = settings or ResidualSettings()
        self._robot = robot
        self._topics = robot.wheel_topics
        self._clock = TickClock(self.settings.ticks, expected=(PREDICTIONS,))
        period = self.settings.ticks.period
        signed = robot.measurement.signed
        # Of the motors, then of the whole robot.
        self._supplies = (*self._topics, TOTAL_TOPIC)
        self._windows = [
            SupplyWindow(period, self.settings.stale, signed or supply == TOTAL_TOPIC)
            for supply in self._supplies
        ]
        self._flows = [Continuity(POWER_TOLERANCE) for _ in self._supplies]
        self._repeats = [RepeatWatch() for _ in self._topics]
        self._limits = PowerLimits.of(robot)
        self._health = InputReporter()
        fastest = fastest_wheel(robot)
        self._encoders = EncoderWindow(
            self.settings.encoder_window, period, self.settings.stale, fastest
        )
        self._has_motor_power = bool(motor_topics(robot))
        self._predictions: dict[int, Prediction] = {}
        lately = transient_ticks(period)
        self._recent: deque[_Modelled] = deque(maxlen=lately)
        self._scatter = ScatterWatch(fastest)
        self._expected = ExpectedMotion(period)
        self._inertial = InertialWatch(robot, period, lately)
        self._voltages = VoltageWatch(lately)
        self._flaws = EncoderFlaws.of(robot)
        self._to_twist = Body.of(robot).to_twist
        self._description = DescriptionWatch(robot, period)
        self._decided = 0  # newest tick

    def retune(self, bands: BandSettings) -> None:
        """Change the bands while running."""
        self.settings = evolve(self.settings, bands=bands)

    def prediction(self, prediction: Prediction) -> Arrival:
        """Take a prediction of the model stage."""
        arrival = self._arrive(PREDICTIONS, prediction.stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._predictions[prediction.stamp_ns] = prediction
        return arrival

    def encoders(self, stamp_ns: int, position: Triple, velocity: Triple) -> Arrival | str:
        """Take wheel angles [rad] and speeds [rad/s], NaN for what a message lacks."""
        arrival = self._arrive(ENCODERS, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            if not self._encoders.add(EncoderSample(stamp_ns, position, velocity)):
                self._encoders.continuity.refuse(_TOO_FAST)
                return f"{_TOO_FAST}; {IGNORED}"
        else:
            self._encoders.continuity.ignore(arrival, stamp_ns, self._clock.off(ENCODERS))
        return arrival

    def power(self, reading: PowerReading) -> Arrival | str:
        """Take what a motor or the whole robot draws; returns why it cannot be, if so."""
        supply, stamp = reading.wheel, reading.stamp_ns
        problem = self._limits.problem(reading)
        if problem is not None:
            self._flows[supply].refuse(problem)
            return f"{problem}; {IGNORED}"
        arrival = self._arrive(self._supplies[supply], stamp)
        if arrival is Arrival.TAKEN and stamp <= self._decided - self.settings.stale:
            self._flows[supply].misplace()
            return "the stamp is too old for any decision to come; the message is ignored"
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._windows[supply].add(reading)
            self._flows[supply].take(stamp)
            if supply != TOTAL:
                self._repeats[supply].take(stamp, (reading.voltage, reading.current, reading.power))
        else:
            ahead = self._clock.off(self._supplies[supply])
            self._flows[supply].ignore(arrival, stamp, ahead)
        return arrival

    def imu(self, stamp_ns: int, rate: Triple, force: Triple) -> Arrival:
        """Take angular rates [rad/s] and specific forces [m/s^2] in base_link, NaN for what is not
        measured."""
        arrival = self._arrive(IMU, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._inertial.add(stamp_ns, rate, force)
        else:
            self._inertial.ignore(arrival, stamp_ns, self._clock.off(IMU))
        return arrival

    def refused(self, topic: str, problem: str) -> None:
        """Take note of a message that nothing can be read from, and why."""
        if topic == ENCODERS:
            self._encoders.continuity.refuse(problem)
        for supply, flow in zip(self._supplies, self._flows, strict=True):
            if topic in (supply, f"{supply}/power") or (
                topic == ARRAY_TOPIC and supply != TOTAL_TOPIC
            ):
                flow.refuse(problem)

    def due(self) -> list[ResidualFrame]:
        """Residuals for the ticks that the stamps have reached, in order."""
        found = []
        for tick in self._clock.due():
            self._decided = tick
            found.append(self._frame(tick))
            self._health.take(tick, self._inputs(tick, found[-1]), self.settings.hardware_id)
        return found

    def reports(self) -> list[DiagnosticMessage]:
        """How the sensors do, as far as it is to be said anew; after `due`."""
        return self._health.due()

    def misdescribed(self) -> tuple[str, ...]:
        """What speaks against robot.yaml and the IMU so far, and what to mend."""
        return tuple(filter(None, (self._description.words(), self.imu_mistake)))

    @property
    def imu_mistake(self) -> str:
        """In which way the IMU is not as described, in words; empty if it is."""
        # Wheels that are not as described show no IMU.
        return "" if self._description.mistake else self._inertial.mistake

    def _inputs(self, tick: int, frame: ResidualFrame) -> list[InputState | Remark]:
        absent = [self._robot.wheel_names[wheel] for wheel in self._encoders.absent(tick)]
        without = f"no {', '.join(absent)} among its names" if absent else ""
        found: list[InputState | Remark] = [
            InputState(ENCODERS, self._encoders.continuity, without)
        ]
        if self._has_motor_power:
            for wheel, topic in enumerate(self._topics):
                missing = frame.residuals[MOTORS[wheel]].missing
                ailment = FROZEN.strip() if missing.endswith(FROZEN) else ""
                found.append(InputState(f"{topic}/power", self._flows[wheel], ailment))
        if self._robot.measurement.total == TOTAL_TOPIC:
            found.append(InputState(TOTAL_TOPIC, self._flows[TOTAL]))
        found += self._inertial.states(tick, frame)
        return [*found, self._description.remark()]

    def _arrive(self, stream: str, stamp_ns: int) -> Arrival:
        arrival = self._clock.arrive(stream, stamp_ns)
        if arrival is Arrival.RESTARTED:
            for window in self._windows:
                window.clear()
            for flow in self._flows:
                flow.leap()
            for watch in self._repeats:
                watch.clear()
            self._decided = 0
            self._encoders.leap()
            self._scatter.clear()
            self._inertial.leap()
            self._voltages.clear()
            self._predictions.clear()
            self._recent.clear()
            self._expected.clear()
        return arrival

    def _frame(self, tick: int) -> ResidualFrame:
        for stamp in [stamp for stamp in self._predictions if stamp < tick]:
            del self._predictions[stamp]
        known = self._predictions.pop(tick, None)
        self._recent.append(_Modelled.of(known or _no_prediction(tick)))
        absent = "" if known else _NO_PREDICTION
        estimate = self._expected.estimate(tick, self._recent[-1].speed, self._encoders)
        speeds = self._speeds(tick, estimate, absent)
        motors = [self._supply(tick, wheel, speeds[wheel]) for wheel in range(WHEELS)]
        powers = [self._motor(wheel, motors[wheel], absent) for wheel in range(WHEELS)]
        self._description.take(tick, speeds, powers)
        derived = [self._derived(wheel, motors[wheel], absent) for wheel in range(WHEELS)]
        twist, bands = self._twist(estimate, speeds), self.settings.bands
        moves = float(np.abs(estimate.speed).max()) > _TURNS  # false where it is NaN
        is_well = not any(item.stale or item.code for item in (*powers, *speeds, *derived))
        yaw, along = self._inertial.residuals(tick, twist, bands, moves=moves, is_well=is_well)
        return ResidualFrame(
            tick,
            (self._total(tick, motors, absent), *powers, *speeds, *derived),
            self._supply_share(tick),
            yaw,
            along,
            self._voltages.residuals(known, bands),
            self._description.mistake,
        )

    def _supply_share(self, tick: int) -> float:
        """Voltage of the supply over the nominal one, NaN where nothing measures it."""
        measured = [window.voltage_at(tick) for window in self._windows]
        motors = sorted(voltage for voltage in measured[:TOTAL] if voltage == voltage)
        if measured[TOTAL] == measured[TOTAL]:
            voltage = measured[TOTAL]
        else:
            voltage = motors[len(motors) // 2] if motors else NAN
        return rounded(voltage / self._robot.supply.nominal_voltage)

    def _supply(self, tick: int, wheel: int, speed: Residual) -> Measured:
        """What a motor draws, or why that is not known."""
        measured = self._windows[wheel].at(tick)
        frozen = self._repeats[wheel].is_frozen(tick, self._work(wheel, speed, measured.unit))
        if not self._has_motor_power:
            return Measured(NAN, "W", NOT_MEASURED)
        missing = self._gap(tick, wheel, measured.value)
        if measured.value == measured.value and frozen:
            missing = f"{self._topics[wheel]}/power{FROZEN}"
        return evolve(measured, value=NAN, missing=missing) if missing else measured

    def _gap(self, tick: int, supply: int, value: float) -> str:
        """Why a measured value does not count at a tick, or there is none; empty if it counts."""
        topic = TOTAL_TOPIC if supply == TOTAL else f"{self._topics[supply]}/power"
        flow, is_known = self._flows[supply], value == value
        if flow.is_rare(tick):
            return f"{GAP}{topic}: it comes too rarely to be compared"
        if not is_known and flow.is_misplaced(tick):
            return f"{GAP}{topic}: its stamps do not fit"
        if is_known:
            return f"{GAP}{topic}" if flow.is_broken(tick) else ""
        return f"{NO_FRESH}{topic}"

    def _work(self, wheel: int, speed: Residual, unit: Unit) -> Work:
        asked = abs(speed.modelled)
        turns = asked > _TURNS or abs(asked + speed.residual) > _TURNS
        expected = self._recent[-1].of_unit(unit)[wheel]
        return Work(turns, not speed.code, expected, self.settings.bands.least(unit))

    def _total(self, tick: int, motors: list[Measured], absent: str) -> Residual:
        source = self._robot.measurement.total
        unit: Unit = "W"
        if source == "sum":
            units = {motor.unit for motor in motors}
            unit = units.pop() if len(units) == 1 else "W"
            value = math.fsum(motor.value for motor in motors) if not units else NAN
            models = [math.fsum(past.of_unit(unit)[:WHEELS]) for past in self._recent]
            missing = f"{NO_FRESH}power of every motor"
        else:
            value = self._windows[TOTAL].at(tick).value if source == "battery_state" else NAN
            models = [past.power[WHEELS] for past in self._recent]
            missing = self._gap(tick, TOTAL, value)
            value = NAN if missing else value
        band = width(models, self.settings.bands.of_total(unit))
        reason = _missing(value, models[-1], missing, absent)
        return _residual(value, models[-1], band, unit, reason)

    def _motor(self, wheel: int, measured: Measured, absent: str) -> Residual:
        return self._drawn(wheel, measured, absent, NO_COMMAND)

    def _derived(self, wheel: int, measured: Measured, absent: str) -> Residual:
        unmodelled = "the model has no motion of the encoders, or no fresh cmd_vel"
        return self._drawn(WHEELS + 1 + wheel, measured, absent, unmodelled)

    def _drawn(self, place: int, measured: Measured, absent: str, unmodelled: str) -> Residual:
        """What a motor draws beside one of the modelled values."""
        value, unit = measured.value, measured.unit
        models = [past.of_unit(unit)[place] for past in self._recent]
        band = width(models, self.settings.bands.of_motor(unit))
        reason = _missing(value, models[-1], measured.missing, absent, unmodelled)
        return _residual(value, models[-1], band, unit, reason)

    def _speeds(self, tick: int, estimate: WheelEstimate, absent: str) -> list[Residual]:
        bands = self.settings.bands
        pauses = self._encoders.continuity.is_broken(tick)
        is_fresh = tick - self._encoders.continuity.last(tick) < self.settings.stale
        reason = f"{GAP}{ENCODERS}" if pauses and is_fresh else NO_ENCODERS
        self._scatter.take(estimate)
        scatter, disorder = self._scatter.seconds, self._scatter.is_disorder
        if disorder:
            reason = f"{GAP}{ENCODERS}: its stamps do not fit"
        counts = self._scatter.counts(self._encoders.resolution)
        speeds, unsure = [], False
        for wheel, value in enumerate(estimate.speed.tolist()):
            models = [past.speed[wheel] for past in self._recent]
            model = models[-1]
            # Against the set direction: "slower than commanded" is negative whichever way it turns.
            sign = -1.0 if model < 0.0 else 1.0
            band = width(models, bands.of_speed)
            noise = estimate.gain * max(scatter * max(abs(model), abs(value)), counts)
            unsure = unsure or noise > _UNSURE * band
            missing = _missing(NAN if disorder else value, model, reason, absent)
            residual = NAN if disorder else rounded(sign * (value - model))
            band = rounded(max(band, BAND_SIGMAS * noise))
            speeds.append(Residual(residual, band, rounded(model), "rad/s", missing))
        if unsure:  # all wheels are read at once: where one cannot be measured, no other is better
            speeds = [evolve(one, residual=NAN, missing=one.missing or SCATTER) for one in speeds]
        return speeds

    def _twist(self, estimate: WheelEstimate, speeds: list[Residual]) -> Array:
        """That the wheels show of the body [m/s, m/s, rad/s], NaN where some wheel shows none."""
        if any(speed.residual != speed.residual for speed in speeds):
            return np.full(3, NAN)
        return np.asarray(self._to_twist @ self._flaws.turned(estimate).speed)


def _residual(value: float, model: float, band: float, unit: Unit, missing: str) -> Residual:
    return Residual(rounded(value - model), rounded(band), rounded(model), unit, missing)


def _missing(
    value: float, model: float, measured: str, absent: str, unmodelled: str = NO_COMMAND
) -> str:
    """Why a residual is unknown, empty if it is known."""
    if math.isnan(value):
        return measured
    if math.isnan(model):
        return absent or unmodelled
    return ""
