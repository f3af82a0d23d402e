"""What a calibration reads out of a recording: encoders, power and commands as arrays."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.messages.intake import (
    NAN,
    Unusable,
    WheelFinder,
    battery_of,
    numbers_of,
    stamp_of,
    twist_of,
)
from tomr_power_model.recordings import Recording, open_recording, require_topic, resolve_topic
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Taker = Callable[[Any, int], None]

_ARRAY_TOPIC = "power"


@frozen
class Recorded:
    """One recording; times in seconds since its first encoder sample, NaN where nothing is known.

    Power is what the robot publishes: W for `measurement.quantity: power` and `supply_current`
    (times the nominal voltage), A for `motor_current`.
    """

    name: str
    encoder_time: Array  # (n,)
    position: Array  # rad, (n, 3)
    velocity: Array  # rad/s, (n, 3)
    power_time: Array  # (m,)
    power: Array  # W or A drawn, (m, 3)
    reading: Array  # as the sensor says it: A, or W where it tells no current, (m, 3)
    total_time: Array  # (l,)
    total: Array  # W drawn by the whole robot, (l,)
    command_time: Array  # (c,)
    command: Array  # m/s, m/s, rad/s in base_link, (c, 3)
    voltage: Array  # of each driver's supply [V], NaN where not told, (m, 3)
    total_voltage: Array  # V, (l,)
    yaw_time: Array  # (g,)
    yaw_rate: Array  # of the gyro [rad/s], (g,)
    start_ns: int = 0  # stamp of time 0
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """From the first to the last encoder sample [s]."""
        return float(self.encoder_time[-1] - self.encoder_time[0])


class _Series:
    """Rows with rising stamps; one that repeats or goes back is dropped, as the stages do."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._stamps: list[int] = []
        self._rows: list[tuple[float, ...]] = []
        self.dropped = 0

    def add(self, stamp_ns: int, *row: float) -> None:
        if stamp_ns <= (self._stamps[-1] if self._stamps else 0):
            self.dropped += 1
            return
        self._stamps.append(stamp_ns)
        self._rows.append(row)

    def __len__(self) -> int:
        return len(self._stamps)

    @property
    def first(self) -> int:
        return self._stamps[0]

    def since(self, start_ns: int) -> tuple[Array, Array]:
        """Times [s] since a stamp, and the rows."""
        seconds = np.float64(1e-9) * (np.array(self._stamps, dtype=np.int64) - start_ns)
        return seconds, np.array(self._rows, dtype=np.float64).reshape(-1, self._width)


class _Collector:
    """Takes the messages of one recording."""

    def __init__(self, recording: Recording, robot: Robot, namespace: str | None) -> None:
        self.recording = recording
        self.robot = robot
        self.namespace = namespace
        self.encoders = _Series(2 * WHEELS)
        self.motors = [_Series(3) for _ in range(WHEELS)]  # power or current; the reading; V
        self.total = _Series(3)
        self.commands = _Series(3)
        self.gyro = _Series(1)
        self.takers: dict[str, Taker] = {}
        self.voltage_missing = False
        self.complaints: dict[str, int] = {}
        self._wheels = WheelFinder(robot.wheel_names)
        self._is_current = robot.measurement.quantity == "motor_current"

    def find(self) -> None:
        """Find the topics; raises InputError for one that must be there."""
        self._on(require_topic(self.recording, "joint_states", self.namespace), self._joints)
        _SOURCES[self.robot.measurement.source](self)
        if self.robot.measurement.total == "battery_state":
            topic = resolve_topic(self.recording, "battery_state", self.namespace)
            if topic is not None:
                self._on(topic, self._supply(self.total))
        topic = resolve_topic(self.recording, "cmd_vel", self.namespace)
        if topic is not None:
            self._on(topic, self._command)
        topic = resolve_topic(self.recording, "imu/data", self.namespace)
        if topic is not None:
            self._on(topic, self._imu)

    def read(self) -> None:
        """Take all messages; what cannot be used is counted and left out."""
        for topic, _, message, receive_ns in self.recording.messages(self.takers):
            try:
                self.takers[topic](message, receive_ns)
            except (Unusable, AttributeError, LookupError, TypeError) as error:
                problem = f"{topic}: {error}"
                self.complaints[problem] = self.complaints.get(problem, 0) + 1

    def _on(self, topic: str, taker: Taker) -> None:
        self.takers[topic] = taker

    def _joints(self, message: Any, receive_ns: int) -> None:
        found = self._wheels.read(message)
        stamp = stamp_of(message, receive_ns)
        self.encoders.add(stamp, *found.position, *found.velocity)
        if self.robot.measurement.source == "joint_effort":
            for series, current in zip(self.motors, found.effort, strict=True):
                series.add(stamp, self._drawn(NAN, current), current, NAN)

    def _command(self, message: Any, receive_ns: int) -> None:
        self.commands.add(stamp_of(message, receive_ns, fallback=True), *twist_of(message))

    def _imu(self, message: Any, receive_ns: int) -> None:
        self.gyro.add(stamp_of(message, receive_ns), float(message.angular_velocity.z))

    def _supply(self, series: _Series) -> Taker:
        def take(message: Any, receive_ns: int) -> None:
            voltage, current = battery_of(message)
            is_current = self._is_current and series is not self.total
            drawn = -current if is_current else self._drawn(voltage, -current)
            series.add(stamp_of(message, receive_ns), drawn, -current, voltage)

        return take

    def _drawn(self, voltage: float, current: float) -> float:
        """Power [W], or the current [A] where that is what is compared."""
        if self._is_current:
            return current
        if np.isnan(voltage):
            self.voltage_missing = True
            voltage = self.robot.supply.nominal_voltage
        return voltage * current

    def battery_states(self) -> None:
        found = [
            resolve_topic(self.recording, f"{name}/power", self.namespace)
            for name in self.robot.wheel_topics
        ]
        if not any(found) and resolve_topic(self.recording, "battery_state", self.namespace):
            raise InputError(
                f"{self.recording.name}: the power of single motors is not there, only "
                "battery_state: set measurement.source: total_only in robot.yaml"
            )
        for name, series in zip(self.robot.wheel_topics, self.motors, strict=True):
            topic = require_topic(self.recording, f"{name}/power", self.namespace)
            self._on(topic, self._supply(series))

    def multi_array(self) -> None:
        is_power = self.robot.measurement.quantity == "power"

        def take(message: Any, receive_ns: int) -> None:
            values = numbers_of(message, WHEELS)[:WHEELS]
            for series, value in zip(self.motors, values, strict=True):
                drawn = value if is_power else self._drawn(NAN, value)
                series.add(receive_ns, drawn, value, NAN)

        self._on(require_topic(self.recording, _ARRAY_TOPIC, self.namespace), take)

    def efforts(self) -> None:
        """They come with the encoders."""

    def total_only(self) -> None:
        require_topic(self.recording, "battery_state", self.namespace)


_SOURCES: dict[str, Callable[[_Collector], None]] = {
    "battery_state": _Collector.battery_states,
    "multi_array": _Collector.multi_array,
    "joint_effort": _Collector.efforts,
    "total_only": _Collector.total_only,
}


def read_recorded(path: Path, robot: Robot, namespace: str | None = None) -> Recorded:
    """Read one recording. Raises InputError where encoders or power are missing."""
    with open_recording(path) as recording:
        collector = _Collector(recording, robot, namespace)
        collector.find()
        collector.read()
        if not len(collector.encoders):
            raise InputError(_no_encoders(recording, robot, collector))
        notes = [recording.warning] if recording.warning else []
    start = collector.encoders.first
    encoder_time, encoders = collector.encoders.since(start)
    power_time, motors = _merged([series.since(start) for series in collector.motors])
    total_time, total = collector.total.since(start)
    command_time, command = collector.commands.since(start)
    yaw_time, yaw_rate = collector.gyro.since(start)
    if not len(power_time) and not len(total_time):
        raise InputError(f"{path}: no power was measured: record the power topics too")
    return Recorded(
        name=path.name or str(path),
        encoder_time=encoder_time,
        position=encoders[:, :WHEELS],
        velocity=encoders[:, WHEELS:],
        power_time=power_time,
        power=motors[:, :, 0],
        reading=motors[:, :, 1],
        total_time=total_time,
        total=total[:, 0],
        command_time=command_time,
        command=command,
        voltage=motors[:, :, 2],
        total_voltage=total[:, 2],
        yaw_time=yaw_time,
        yaw_rate=yaw_rate[:, 0],
        start_ns=start,
        notes=(*notes, *_notes(path, collector)),
    )


def _no_encoders(recording: Recording, robot: Robot, collector: _Collector) -> str:
    seen = next(iter(collector.complaints), "no joint_states message")
    return (
        f"{recording.path}: no encoder sample of {', '.join(robot.wheel_names)} ({seen}): "
        "this robot.yaml belongs to another robot, or set robot.wheel_names"
    )


def _notes(path: Path, collector: _Collector) -> list[str]:
    notes = [f"{path}: {text} ({count} messages)" for text, count in collector.complaints.items()]
    dropped = sum(s.dropped for s in (collector.encoders, *collector.motors, collector.total))
    if dropped:
        notes.append(f"{path}: {dropped} samples repeat or precede an earlier stamp: left out")
    if collector.voltage_missing:
        volts = collector.robot.supply.nominal_voltage
        notes.append(f"{path}: no voltage is told, supply.nominal_voltage = {volts:g} V is taken")
    return notes


def _merged(series: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Three series on one time axis, (m, 3, 3), NaN where a wheel has no sample."""
    times = np.unique(np.concatenate([time for time, _ in series]))
    merged = np.full((len(times), WHEELS, 3), np.nan)
    for wheel, (time, rows) in enumerate(series):
        merged[np.searchsorted(times, time), wheel] = rows
    return times, merged
