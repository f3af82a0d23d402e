"""The power monitor: an INA226-like average over 5 ms, with noise and quanta, and its messages.

Robots publish motor power in several ways; `measurement` in the description says which, and the
simulated robot does likewise.
"""

import math
from collections.abc import Callable

import numpy as np
from attrs import frozen

from tomr_power_model.messages.plain import NANOSECONDS, battery_state
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.faults import FaultActions
from tomr_sim_bridge.plant import moments, samples
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.moments import Memory
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.wheels import Vector

WINDOW_NS = 5_000_000  # average over this time before the stamp
ARRAY_TOPIC = "power"
VOLTAGE_TOPIC = "motor_voltage"
_TOTAL_NOISE = 2.0  # the battery's monitor is that much noisier than a driver's


@frozen
class Reading:
    """Measured voltage [V] and current drawn [A] of one supply, or of one motor; NaN: unknown."""

    voltage: float
    drawn: float
    is_lost: bool = False  # it never comes


class PowerMonitor:
    """Reads drivers or motors, and the battery."""

    def __init__(
        self, robot: Robot, design: PlantDesign, memory: Memory, random: np.random.Generator
    ) -> None:
        self._robot = robot
        self._design = design
        self._memory = memory
        self._random = random
        self._reads_motor = robot.measurement.quantity == "motor_current"
        self._column = moments.MOTOR_CURRENT if self._reads_motor else moments.SUPPLY_CURRENT
        self._lagged = np.full(WHEELS, math.nan)
        self._publish = _SOURCES[robot.measurement.source]
        self.efforts: list[float] = []  # A, latest currents for JointState.effort
        self.commanded = [0.0] * WHEELS  # V, of the drivers
        self.actions: FaultActions | None = None  # what faults do now
        self._held: list[Reading | None] = [None] * WHEELS  # of frozen sensors

    def samples(self, stamp: int) -> list[Sample]:
        """Measure at a stamp [ns]."""
        readings = [self._wheel(wheel, stamp) for wheel in range(WHEELS)]
        found = self._publish(self, stamp, readings)
        if self._robot.measurement.total == "battery_state":
            change = self._window(stamp) / (WINDOW_NS / NANOSECONDS)
            total = self._digitise(
                float(change[moments.VOLTAGE]),
                self._design.total_scale * float(change[moments.TOTAL_CURRENT]),
                _TOTAL_NOISE,
            )
            message = battery_state(stamp, total.voltage, -total.drawn, "battery")
            found.append(Sample("battery_state", stamp, message))
        if self._robot.measurement.motor_voltage:
            found.append(Sample(VOLTAGE_TOPIC, stamp, samples.multi_array(self.commanded)))
        return found

    def _window(self, until: int) -> Vector:
        return self._memory.at(until) - self._memory.at(until - WINDOW_NS)

    def _wheel(self, wheel: int, stamp: int) -> Reading:
        design, measurement = self._design, self._robot.measurement
        until = stamp - round(float(design.power_delay[wheel]) * NANOSECONDS)
        change = self._window(until) / (WINDOW_NS / NANOSECONDS)
        voltage, drawn = float(change[moments.VOLTAGE]), float(change[self._column][wheel])
        if design.power_lag[wheel] > 0:
            period = 1.0 / self._robot.sensors.power_rate
            share = 1.0 - math.exp(-period / float(design.power_lag[wheel]))
            last = float(self._lagged[wheel])
            drawn = drawn if math.isnan(last) else last + share * (drawn - last)
            self._lagged[wheel] = drawn
        scale, bias = float(design.power_scale[wheel]), float(design.power_bias[wheel])
        if self.actions is not None:
            scale *= float(self.actions.meter_scale[wheel])
            bias += float(self.actions.meter_bias[wheel])
        drawn = drawn * scale + bias / voltage
        reading = self._digitise(voltage, drawn, 1.0)
        reading = Reading(
            voltage=reading.voltage if measurement.quantity == "power" else math.nan,
            drawn=reading.drawn if measurement.signed else abs(reading.drawn),
        )
        return self._spoilt(wheel, reading)

    def _spoilt(self, wheel: int, reading: Reading) -> Reading:
        """What a sensor makes of a reading that is frozen or dead."""
        frozen, lost = 0.0, 0.0
        if self.actions is not None:
            frozen = float(self.actions.meter_frozen[wheel])
            lost = float(self.actions.meter_lost[wheel])
        held = self._held[wheel]
        if frozen == 0.0 or held is None:
            self._held[wheel] = held = reading
        if frozen > 0.0:
            reading = Reading(held.voltage, frozen * held.drawn + (1.0 - frozen) * reading.drawn)
        if lost > 0.0 and self._random.random() < lost:
            return Reading(math.nan, math.nan, is_lost=True)
        return reading

    def _digitise(self, voltage: float, drawn: float, noise: float) -> Reading:
        given = self._robot.sensors
        noisy_voltage = voltage + noise * given.voltage_noise * self._random.standard_normal()
        noisy_drawn = drawn + noise * given.current_noise * self._random.standard_normal()
        return Reading(
            _rounded(noisy_voltage, given.voltage_resolution),
            _rounded(noisy_drawn, given.current_resolution),
        )

    def _battery_states(self, stamp: int, readings: list[Reading]) -> list[Sample]:
        return [
            Sample(
                f"{topic}/power",
                stamp,
                battery_state(stamp, reading.voltage, -reading.drawn, topic),
            )
            for topic, reading in zip(self._robot.wheel_topics, readings, strict=True)
            if not reading.is_lost
        ]

    def _multi_array(self, stamp: int, readings: list[Reading]) -> list[Sample]:
        is_power = self._robot.measurement.quantity == "power"
        values = [
            reading.voltage * reading.drawn if is_power else reading.drawn for reading in readings
        ]
        return [Sample(ARRAY_TOPIC, stamp, samples.multi_array(values))]

    def _joint_effort(self, stamp: int, readings: list[Reading]) -> list[Sample]:
        self.efforts = [reading.drawn for reading in readings]
        return []

    def _nothing(self, stamp: int, readings: list[Reading]) -> list[Sample]:
        return []


_SOURCES: dict[str, Callable[[PowerMonitor, int, list[Reading]], list[Sample]]] = {
    "battery_state": PowerMonitor._battery_states,
    "multi_array": PowerMonitor._multi_array,
    "joint_effort": PowerMonitor._joint_effort,
    "total_only": PowerMonitor._nothing,
}


def _rounded(value: float, quantum: float) -> float:
    return value if quantum == 0.0 else round(value / quantum) * quantum
