"""The model stage: commands and encoders in, one prediction per tick out."""

import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen
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
from tomr_power_model.model.ticks import Arrival, TickClock
from tomr_power_model.physics.model import DrivePower, PhysicalModel, WheelMotion
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
        self._drop = sum(effect.voltage_drop() for effect in self._dynamics.effects)

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
        return arrival

    def _predict(self, tick: int) -> Prediction:
        estimate = self._encoders.at(tick)
        motion = self._expected.over(tick, estimate.speed)
        drives = self._model.power(_stacked(motion, estimate, self._yaw_rate(tick)))
        measured = _Means.last(drives)
        if motion is None:
            return Prediction(
                tick, UNKNOWN, UNKNOWN, _UNKNOWN, UNKNOWN_READING, self._readings(measured)
            )
        commanded = _Means.of_all_but_last(drives)
        return Prediction(
            stamp_ns=tick,
            speed=_triple(motion.speed.mean(axis=0).tolist()),
            torque=_triple(commanded.torque),
            motors=self._readings(commanded),
            total=self._total(commanded),
            from_encoders=self._readings(measured),
        )

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

    def _readings(self, means: "_Means") -> Readings:
        if self._reads_motor:
            first, second, third = map(self._at_motor, means.at_motor, means.current)
        else:
            voltage = self._bus_voltage(means.total)
            first, second, third = (
                SupplyReading.rounded(voltage, power / voltage) for power in means.power
            )
        return first, second, third

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
    def of_all_but_last(cls, drives: DrivePower) -> Self:
        values = (drives.torque, drives.current, drives.voltage * drives.current, drives.power)
        means = np.add.reduce(np.array(values)[:, :-1], axis=1) / (len(drives.power) - 1)
        other = None if drives.other is None else float(drives.other[:-1].mean())
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


def _stacked(motion: WheelMotion | None, estimate: WheelEstimate, yaw_rate: float) -> WheelMotion:
    """Expected motion and, as the last row, the measured one: one pass through the model."""
    speed, acceleration = estimate.speed[None, :], estimate.acceleration[None, :]
    if motion is not None:
        speed = np.concatenate([motion.speed, speed])
        acceleration = np.concatenate([motion.acceleration, acceleration])
    if math.isnan(yaw_rate):
        return WheelMotion(speed, acceleration)
    gyro = np.full(len(speed), np.nan)
    gyro[-1] = yaw_rate
    return WheelMotion(speed, acceleration, gyro)


def _triple(values: Sequence[float] | Array) -> Triple:
    first, second, third = (float(value) for value in values)
    return first, second, third
