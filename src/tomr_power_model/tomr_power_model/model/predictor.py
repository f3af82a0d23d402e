"""The model stage: commands and encoders in, one prediction per tick out."""

from collections.abc import Sequence

import numpy as np
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
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

COMMANDS = "cmd_vel"
ENCODERS = "joint_states"
IMU = "imu/data"


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
        commanded = _mean(drives, slice(0, -1)) if motion is not None else None
        measured = _mean(drives, slice(-1, None))
        speed = UNKNOWN if motion is None else _triple(motion.speed.mean(axis=0))
        return Prediction(
            stamp_ns=tick,
            speed=speed,
            torque=UNKNOWN if commanded is None else _triple(commanded.torque[0]),
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
        drop = sum(effect.voltage_drop() for effect in self._dynamics.effects)
        return nominal - drop * power / nominal

    def _readings(self, drives: DrivePower | None) -> Readings:
        if drives is None:
            return UNKNOWN_READING, UNKNOWN_READING, UNKNOWN_READING
        read = self._at_motor if self._reads_motor else self._at_supply
        first, second, third = (read(drives, wheel) for wheel in range(WHEELS))
        return first, second, third

    @property
    def _reads_motor(self) -> bool:
        return self._robot.measurement.quantity == "motor_current"

    def _at_supply(self, drives: DrivePower, wheel: int) -> SupplyReading:
        voltage = self._bus_voltage(float(drives.power[0].sum()))
        return SupplyReading.rounded(voltage, float(drives.power[0, wheel]) / voltage)

    def _at_motor(self, drives: DrivePower, wheel: int) -> SupplyReading:
        """Motor current, and the terminal voltage that makes voltage * current the power."""
        current = float(drives.current[0, wheel])
        power = float(drives.voltage[0, wheel] * drives.current[0, wheel])
        if not self._robot.measurement.signed:
            current = abs(current)
        return SupplyReading.rounded(power / current if current else 0.0, current)

    def _total(self, drives: DrivePower | None) -> SupplyReading:
        if drives is None:
            return UNKNOWN_READING
        if self._reads_motor:
            voltage = self._robot.supply.nominal_voltage
            power = float((drives.voltage[0] * drives.current[0]).sum())
            return SupplyReading.rounded(voltage, power / voltage)
        other = drives.other
        auxiliary = self._robot.supply.auxiliary_power if other is None else float(other[0])
        power = float(drives.power[0].sum()) + auxiliary
        voltage = self._bus_voltage(power)
        return SupplyReading.rounded(voltage, power / voltage)


def _stacked(motion: WheelMotion | None, estimate: WheelEstimate, yaw_rate: float) -> WheelMotion:
    """Expected motion and, as the last row, the measured one: one pass through the model."""
    speed, acceleration = estimate.speed[None, :], estimate.acceleration[None, :]
    if motion is not None:
        speed = np.concatenate([motion.speed, speed])
        acceleration = np.concatenate([motion.acceleration, acceleration])
    gyro = np.full(len(speed), np.nan)
    gyro[-1] = yaw_rate
    return WheelMotion(speed, acceleration, gyro)


def _mean(drives: DrivePower, rows: slice) -> DrivePower:
    """Mean over some rows, shape (1, 3); NaN in a wheel's motion makes its power NaN."""

    def mean(values: Array) -> Array:
        return np.asarray(values[rows].mean(axis=0, keepdims=True))

    current = mean(drives.current)
    power_at_motor = mean(drives.voltage * drives.current)
    with np.errstate(divide="ignore", invalid="ignore"):
        voltage = np.where(current == 0.0, 0.0, power_at_motor / current)
    other = None if drives.other is None else mean(drives.other)
    return DrivePower(mean(drives.torque), current, voltage, mean(drives.power), other)


def _triple(values: Sequence[float] | Array) -> Triple:
    first, second, third = (float(value) for value in values)
    return first, second, third
