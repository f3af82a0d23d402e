"""Sensors of the real robot, and the recording that they make."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.signal import lfilter

from concealed.driving import BATTERY, Array, Track
from concealed.robots import WHEEL_JOINTS, Family
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS, battery_state, joint_state
from tomr_power_model.recordings import RecordingWriter
from tomr_sim_bridge.plant import samples
from tomr_sim_bridge.plant.samples import Sample

ENCODER_RATE, POWER_RATE, IMU_RATE = 100.0, 50.0, 100.0  # Hz
SUPPLIES = (*(name.removesuffix("_joint") + "/power" for name in WHEEL_JOINTS), "battery_state")
BATTERY_NOISE = 2.0  # times that of a driver's monitor
_VOLTAGE_RESOLUTION = 1.25e-3  # V
_MOTOR_COUNTS = 2048.0  # per turn of the motor shaft
_GYRO_NOISE, _ACCELEROMETER_NOISE = 2e-3, 0.03  # rad/s, m/s^2
_RECEIVED_AFTER = (0.0002, 0.0015)  # s


@frozen
class SensorSet:
    """Flaws of a robot's sensors; all zero for the simulation's."""

    voltage_noise: float = 0.0  # V
    current_noise: float = 0.0  # A
    current_resolution: float = 0.0  # A
    voltage_resolution: float = 0.0  # V
    noise: Literal["white", "autocorrelated"] = "white"
    correlation_time: float = 0.0  # s, of autocorrelated noise
    encoder_resolution: float = 0.0  # rad
    gyro_noise: float = 0.0  # rad/s
    accelerometer_noise: float = 0.0  # m/s^2
    jitter: float = 0.0  # s, of the stamps
    late: float = 0.0  # s, longest time until a topic begins
    lost: float = 0.0  # share of single messages
    gap: float = 0.0  # s, longest silence of a topic
    imu: bool = True
    wheel_power: bool = True


def drawn_sensors(
    family: Family,
    gear: float,
    noise: Literal["white", "autocorrelated"],
    wheel_power: bool,
    random: np.random.Generator,
) -> SensorSet:
    """Sensors of a real robot."""
    return SensorSet(
        voltage_noise=float(random.uniform(0.001, 0.003)),
        current_noise=float(random.uniform(*family.current_noise)),
        current_resolution=family.current_resolution,
        voltage_resolution=_VOLTAGE_RESOLUTION,
        noise=noise,
        correlation_time=float(random.uniform(0.1, 0.6)),
        encoder_resolution=2.0 * math.pi / (_MOTOR_COUNTS * gear),
        gyro_noise=_GYRO_NOISE,
        accelerometer_noise=_ACCELEROMETER_NOISE,
        jitter=float(random.uniform(0.0002, 0.0008)),
        late=0.35,
        lost=float(random.uniform(0.001, 0.004)),
        gap=float(random.uniform(0.05, 0.14)),
        imu=bool(random.random() < 0.5),
        wheel_power=wheel_power,
    )


@frozen
class Measured:
    """What the power monitor of one supply measured: stamp [s], voltage [V], current drawn [A]."""

    time: Array
    voltage: Array
    current: Array

    @property
    def power(self) -> Array:
        """W drawn, from single precision, as the message holds it."""
        voltage, current = (a.astype(np.float32) for a in (self.voltage, self.current))
        return np.asarray(voltage.astype(np.float64) * current.astype(np.float64))


@frozen
class Clock:
    """When a sensor sampled, what it says when, and which of its messages arrive."""

    sampled: Array  # s
    stamped: Array  # s
    arrives: NDArray[np.bool_]


def clock_of(track: Track, rate: float, sensors: SensorSet, random: np.random.Generator) -> Clock:
    """Samples on an even grid; it is the stamps that jitter, as they do where a host sets them."""
    end = float(track.time[-1])
    count = math.floor(end * rate + 1e-6)
    sampled = np.arange(1, count + 1) / rate
    stamped = sampled + _jitter(count, 0.4 / rate, sensors, random)
    arrives = (random.random(count) >= sensors.lost) & (sampled >= sensors.late * random.random())
    begin = random.uniform(0.1, 0.9) * end
    arrives &= (sampled < begin) | (sampled > begin + sensors.gap * random.random())
    return Clock(sampled, stamped, arrives)


def _jitter(count: int, most: float, sensors: SensorSet, random: np.random.Generator) -> Array:
    return np.clip(sensors.jitter * random.standard_normal(count), -most, most)


def noise_of(count: int, sensors: SensorSet, rate: float, random: np.random.Generator) -> Array:
    """Noise of unit variance, first-order autocorrelated if the sensors' is."""
    white = random.standard_normal(count)
    if sensors.noise == "white":
        return white
    keep = math.exp(-1.0 / (rate * sensors.correlation_time))
    drive = math.sqrt(1.0 - keep**2) * white
    drive[0] = white[0]
    return np.asarray(lfilter([1.0], [1.0, -keep], drive))


def measured(
    track: Track, supply: int, sensors: SensorSet, random: np.random.Generator
) -> Measured:
    """Read one supply: 0..2 the wheels' drivers, 3 the battery."""
    clock = clock_of(track, POWER_RATE, sensors, random)
    count = len(clock.sampled)
    voltage, current = track.supply_at(clock.sampled, supply)
    times = BATTERY_NOISE if supply == BATTERY else 1.0
    voltage = voltage + times * sensors.voltage_noise * random.standard_normal(count)
    wander = noise_of(count, sensors, POWER_RATE, random)
    current = current + times * sensors.current_noise * wander
    return Measured(
        clock.stamped[clock.arrives],
        _rounded(voltage, sensors.voltage_resolution)[clock.arrives],
        _rounded(current, sensors.current_resolution)[clock.arrives],
    )


def write_recording(
    path: Path, track: Track, sensors: SensorSet, start_ns: int, random: np.random.Generator
) -> dict[str, Measured]:
    """Write a recording and return what it says about power, by topic."""
    readings = {
        topic: measured(track, supply, sensors, random)
        for supply, topic in enumerate(SUPPLIES)
        if supply == BATTERY or sensors.wheel_power
    }
    found = [
        *_commands(track, sensors, start_ns, random),
        *_joint_states(track, sensors, start_ns, random),
    ]
    for topic, reading in readings.items():
        found.extend(_power(topic, reading, start_ns))
    if sensors.imu:
        found.extend(_imu(track, sensors, start_ns, random))
    delays = random.uniform(*_RECEIVED_AFTER, len(found)) * NANOSECONDS
    received = [
        (sample.stamp_ns + int(delay), sample) for sample, delay in zip(found, delays, strict=True)
    ]
    received.sort(key=lambda pair: pair[0])
    with RecordingWriter(path) as writer:
        for stamp, sample in received:
            message = to_bag(sample.message)
            writer.write(sample.topic, sample.message.type_name, message, stamp)
    return readings


def _commands(
    track: Track, sensors: SensorSet, start_ns: int, random: np.random.Generator
) -> Iterator[Sample]:
    stamped = track.command_time + _jitter(len(track.command), 0.01, sensors, random)
    for at, (v_x, v_y, omega_z) in zip(stamped, track.command, strict=True):
        stamp = start_ns + round(at * NANOSECONDS)
        yield samples.command_sample(stamp, float(v_x), float(v_y), float(omega_z))


def _joint_states(
    track: Track, sensors: SensorSet, start_ns: int, random: np.random.Generator
) -> Iterator[Sample]:
    clock = clock_of(track, ENCODER_RATE, sensors, random)
    angle = _rounded(_at(clock.sampled, track, track.angle), sensors.encoder_resolution)
    speed = np.diff(angle, axis=0, prepend=angle[:1]) * ENCODER_RATE
    rows = (values[clock.arrives] for values in (clock.stamped, angle, speed))
    for at, position, velocity in zip(*rows, strict=True):
        stamp = start_ns + round(at * NANOSECONDS)
        message = joint_state(
            stamp, WHEEL_JOINTS, position=position.tolist(), velocity=velocity.tolist()
        )
        yield Sample("joint_states", stamp, message)


def _power(topic: str, reading: Measured, start_ns: int) -> Iterator[Sample]:
    place = topic.removesuffix("/power").removesuffix("_state")
    for at, voltage, current in zip(reading.time, reading.voltage, reading.current, strict=True):
        stamp = start_ns + round(at * NANOSECONDS)
        message = battery_state(stamp, float(voltage), -float(current), place)
        yield Sample(topic, stamp, message)


def _imu(
    track: Track, sensors: SensorSet, start_ns: int, random: np.random.Generator
) -> Iterator[Sample]:
    clock = clock_of(track, IMU_RATE, sensors, random)
    columns = [_at(clock.sampled, track, values) for values in (track.turning, track.pull)]
    rows = np.column_stack(columns)
    rows[:, :3] += sensors.gyro_noise * random.standard_normal((len(rows), 3))
    rows[:, 3:] += sensors.accelerometer_noise * random.standard_normal((len(rows), 3))
    for at, row in zip(clock.stamped[clock.arrives], rows[clock.arrives], strict=True):
        stamp = start_ns + round(at * NANOSECONDS)
        yield Sample("imu/data", stamp, samples.imu(stamp, row[:3].tolist(), row[3:].tolist()))


def _at(when: Array, track: Track, values: Array) -> Array:
    return np.column_stack([np.interp(when, track.time, column) for column in values.T])


def _rounded(values: Array, quantum: float) -> Array:
    return values if quantum == 0.0 else np.round(values / quantum) * quantum
