"""The model stage: commands and encoders in, one prediction per tick out."""

import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.messages.readings import UNKNOWN_READING, SupplyReading
from tomr_power_model.model.encoders import (
    UNKNOWN,
    EncoderSample,
    EncoderWindow,
    Triple,
    WheelEstimate,
)
from tomr_power_model.model.expected import ExpectedMotion
from tomr_power_model.model.power_models import POWER_MODELS
from tomr_power_model.model.prediction import Prediction, Readings
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.model.slow_states import Monitors, Surroundings, Windings
from tomr_power_model.model.ticks import Arrival, TickClock
from tomr_power_model.physics.model import DrivePower, PhysicalModel, PowerModel, WheelMotion
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

COMMANDS = "cmd_vel"
ENCODERS = "joint_states"
IMU = "imu/data"

_UNKNOWN: Readings = (UNKNOWN_READING, UNKNOWN_READING, UNKNOWN_READING)


class PowerPredictor:
    """Streaming core of the power model; driven by stamps, the same online and offline.

    Feed messages as they come, then take the predictions that are `due`.
    """

    def __init__(self, robot: Robot, settings: ModelSettings | None = None) -> None:
        self.settings = settings or ModelSettings()
        self._robot = robot
        make = POWER_MODELS[self.settings.power_model].make
        self._model = make(robot, self.settings.model_values)
        # Which motion a command leads to is a matter of dynamics, whatever predicts the power.
        self._dynamics = PhysicalModel.of(robot)
        self._clock = TickClock(self.settings.ticks)
        self._expected = ExpectedMotion(robot, self._dynamics, self.settings)
        self._encoders = EncoderWindow(
            self.settings.encoder_window, self.settings.ticks.period, self.settings.stale
        )
        self._gyro: tuple[int, float] | None = None
        self._reads_motor = robot.measurement.quantity == "motor_current"
        self._make_slow_states(self._model)
        self._drop = sum(float(effect.voltage_drop()) for effect in self._dynamics.effects)

    def _make_slow_states(self, model: PowerModel) -> None:
        """States of the effects that remember; None for each that this robot has not."""
        period_s = 1e-9 * self.settings.ticks.period
        self._surroundings = Surroundings.of(self._dynamics, period_s, self._expected.steps)
        self._windings: Windings | None = None
        self._commanded: Monitors | None = None
        self._measured: Monitors | None = None
        if isinstance(model, PhysicalModel):
            # The paper's coefficients are fitted to what the monitors showed of warm windings.
            self._windings = Windings.of(model, period_s)
            self._commanded = Monitors.of(model.effects, period_s)
            self._measured = Monitors.of(model.effects, period_s)

    def command(self, stamp_ns: int, twist: Triple) -> Arrival:
        """Take a commanded twist (v_x, v_y [m/s], omega_z [rad/s]) in base_link."""
        arrival = self._arrive(COMMANDS, stamp_ns, periodic=False)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._expected.command(stamp_ns, twist)
        return arrival

    def encoders(self, stamp_ns: int, position: Triple, velocity: Triple) -> Arrival:
        """Take wheel angles [rad] and speeds [rad/s], NaN for what a message lacks."""
        arrival = self._arrive(ENCODERS, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._encoders.add(EncoderSample(stamp_ns, position, velocity))
        return arrival

    def imu(self, stamp_ns: int, yaw_rate: float) -> Arrival:
        """Take a gyro's yaw rate [rad/s]; it corrects the omega x v terms if `use_imu`."""
        arrival = self._arrive(IMU, stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._gyro = (stamp_ns, yaw_rate)
        return arrival

    def due(self) -> list[Prediction]:
        """Predictions for the ticks that the stamps have reached, in order."""
        return [self._predict(tick) for tick in self._clock.due()]

    def _arrive(self, stream: str, stamp_ns: int, periodic: bool = True) -> Arrival:
        arrival = self._clock.arrive(stream, stamp_ns, periodic)
        if arrival is Arrival.RESTARTED:
            self._expected.clear()
            self._encoders.clear()
            self._gyro = None
            for state in (self._surroundings, self._windings, self._commanded, self._measured):
                if state is not None:
                    state.clear()
        return arrival

    def _predict(self, tick: int) -> Prediction:
        estimate = self._encoders.at(tick)
        yaw_rate = self._yaw_rate(tick)
        motion, measured_motion = self._motions(tick, estimate, yaw_rate)
        stacked = _stacked(motion, measured_motion, yaw_rate)
        if self._windings is not None:
            stacked = evolve(stacked, warm=self._windings.warm)
        drives = self._model.power(stacked)
        rows = len(measured_motion.speed)
        if self._windings is not None:
            squared = drives.current**2
            expected = np.full(3, np.nan) if motion is None else squared[:-rows].mean(axis=0)
            self._windings.heat(squared[-rows:].mean(axis=0), expected)
        measured = _Means.last(drives) if rows == 1 else _Means.of(drives, slice(-rows, None))
        from_encoders = self._readings(measured, self._measured)
        if motion is None:
            if self._commanded is not None:
                self._commanded.shown(UNKNOWN)
            return Prediction(tick, UNKNOWN, UNKNOWN, _UNKNOWN, UNKNOWN_READING, from_encoders)
        commanded = _Means.of(drives, slice(None, -rows))
        return Prediction(
            stamp_ns=tick,
            speed=_triple(motion.speed.mean(axis=0).tolist()),
            torque=_triple(commanded.torque),
            motors=self._readings(commanded, self._commanded),
            total=self._total(commanded),
            from_encoders=from_encoders,
        )

    def _motions(
        self, tick: int, estimate: WheelEstimate, yaw_rate: float
    ) -> tuple[WheelMotion | None, WheelMotion]:
        """Motion expected from the command, if any, and measured."""
        around = self._surroundings
        warm = None if self._windings is None else self._windings.warm
        if around is None:
            motion = self._expected.over(tick, estimate.speed, warm=warm)
            return motion, WheelMotion(estimate.speed[None, :], estimate.acceleration[None, :])
        angle = self._encoders.angle(tick) if around.needs_angle else np.full(3, np.nan)
        resisting = around.torque(estimate, angle, yaw_rate)
        motion = self._expected.over(tick, estimate.speed, resisting, warm)
        around.turn(motion)
        return motion, around.motion(estimate, resisting)

    def _yaw_rate(self, tick: int) -> float:
        """The gyro's yaw rate [rad/s], NaN where it is not used or stale."""
        if self._gyro is None or not self.settings.use_imu:
            return np.nan
        stamp, rate = self._gyro
        return rate if tick - stamp < self.settings.stale else np.nan

    def _bus_voltage(self, power: float) -> float:
        """Supply voltage under a load [V], sagging to first order."""
        nominal = self._robot.supply.nominal_voltage
        return nominal - self._drop * power / nominal

    def _readings(self, means: "_Means", monitors: Monitors | None) -> Readings:
        if self._reads_motor:
            if monitors is not None:
                means = self._as_shown(means, monitors)
            first, second, third = map(self._at_motor, means.at_motor, means.current)
        else:
            voltage = self._bus_voltage(means.total)
            powers = means.power if monitors is None else monitors.shown(means.power)
            first, second, third = (
                SupplyReading.rounded(voltage, power / voltage) for power in powers
            )
        return first, second, third

    def _as_shown(self, means: "_Means", monitors: Monitors) -> "_Means":
        """Motor currents as their monitors show them, which take them for those of the supply."""
        nominal = self._robot.supply.nominal_voltage
        shown = monitors.shown([nominal * current for current in means.current])
        current = [power / nominal for power in shown]
        volts = [p / i if i else 0.0 for p, i in zip(means.at_motor, means.current, strict=True)]
        at_motor = [v * i for v, i in zip(volts, current, strict=True)]
        return evolve(means, current=current, at_motor=at_motor)

    def _at_motor(self, power: float, current: float) -> SupplyReading:
        """Motor current, and the terminal voltage that makes voltage * current the power."""
        if not self._robot.measurement.signed:
            current = abs(current)
        return SupplyReading.rounded(power / current if current else 0.0, current)

    def _total(self, means: "_Means") -> SupplyReading:
        if self._reads_motor:
            voltage = self._robot.supply.nominal_voltage
            return SupplyReading.rounded(voltage, _sum(means.at_motor) / voltage)
        auxiliary = self._robot.supply.auxiliary_power if means.other is None else means.other
        power = means.total + auxiliary
        voltage = self._bus_voltage(power)
        return SupplyReading.rounded(voltage, power / voltage)


@frozen
class _Means:
    """Means over some rows of DrivePower, one number per wheel; NaN where the motion is."""

    torque: list[float]  # N m
    current: list[float]  # A
    at_motor: list[float]  # voltage * current [W]
    power: list[float]  # W
    other: float | None

    @classmethod
    def of(cls, drives: DrivePower, rows: slice) -> Self:
        values = (drives.torque, drives.current, drives.voltage * drives.current, drives.power)
        chosen = np.array(values)[:, rows]
        means = np.add.reduce(chosen, axis=1) / chosen.shape[1]
        other = None if drives.other is None else float(drives.other[rows].mean())
        torque, current, at_motor, power = means.tolist()
        return cls(torque, current, at_motor, power, other)

    @classmethod
    def last(cls, drives: DrivePower) -> Self:
        current = drives.current[-1]
        at_motor = drives.voltage[-1] * current
        other = None if drives.other is None else float(drives.other[-1])
        return cls(
            drives.torque[-1].tolist(),
            current.tolist(),
            at_motor.tolist(),
            drives.power[-1].tolist(),
            other,
        )

    @property
    def total(self) -> float:
        return _sum(self.power)


def _sum(values: list[float]) -> float:
    """Plain sum: that of Python 3.12 rounds differently from 3.11's."""
    return values[0] + values[1] + values[2]


def _stacked(expected: WheelMotion | None, measured: WheelMotion, yaw_rate: float) -> WheelMotion:
    """Expected motion and, as the last rows, the measured one: one pass through the model."""
    speed, acceleration, resisting = measured.speed, measured.acceleration, measured.resisting
    if expected is not None:
        speed = np.concatenate([expected.speed, speed])
        acceleration = np.concatenate([expected.acceleration, acceleration])
        if resisting is not None and expected.resisting is not None:
            resisting = np.concatenate([expected.resisting, resisting])
    if math.isnan(yaw_rate):
        return WheelMotion(speed, acceleration, None, resisting)
    gyro = np.full(len(speed), np.nan)
    gyro[-len(measured.speed) :] = yaw_rate
    return WheelMotion(speed, acceleration, gyro, resisting)


def _triple(values: Sequence[float] | Array) -> Triple:
    first, second, third = (float(value) for value in values)
    return first, second, third
