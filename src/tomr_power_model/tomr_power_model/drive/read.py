"""A recording as a `Drive`: every source of power, one policy for what is missing, dejittered."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.dejitter import dejitter, even
from tomr_power_model.drive.record import Drive
from tomr_power_model.drive.series import Series
from tomr_power_model.drive.sources import (
    ENCODER_TOPIC,
    TOTAL,
    TOTAL_TOPIC,
    PowerTopic,
    motor_topics,
    total_topics,
)
from tomr_power_model.errors import InputError, counted, one_line
from tomr_power_model.limits import limits, too_large
from tomr_power_model.messages.inertial import Imu
from tomr_power_model.messages.intake import (
    MALFORMED,
    stamp_of,
    twist_of,
)
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.recordings import Recording, open_recording, require_topic, resolve_topic
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Taker = Callable[[Any, int], None]

_ENCODERS, _COMMANDS, _IMU = ENCODER_TOPIC, "cmd_vel", "imu/data"
_AROUND = 60.0  # s before and after the encoders, in which commands count
_TOGETHER = 2e-4  # s: samples of several supplies that were taken at once
_CLOCK_OFF = 5e-3  # by which two clocks may run apart
_MOST_KINDS = 20  # of complaints that are distinguished
_NO_CLOCK = 0.1  # simulated time is no clock that is off


class _Collector:
    """Takes the messages of one recording."""

    def __init__(self, recording: Recording, robot: Robot, namespace: str | None) -> None:
        self.recording = recording
        self.robot = robot
        self.namespace = namespace
        self.encoders = Series(2 * WHEELS)
        self.supplies = [Series(3) for _ in range(WHEELS + 1)]  # power, current, voltage
        self.commands = Series(3)
        self.imu = Series(6)
        self.takers: dict[str, list[Taker]] = {}
        self.complaints: dict[str, int] = {}
        self._wheels = WheelStream(robot.wheel_names)
        self._inertial = Imu(robot.imu_rpy)

    def find(self) -> None:
        """Find the topics; raises InputError for one that must be there."""
        self._on(self._required(_ENCODERS), self._joints)
        motors = motor_topics(self.robot)
        has_any = any(self._found(item.topic) for item in motors) or not motors
        if not has_any and self._found(TOTAL_TOPIC):
            raise InputError(
                f"{self.recording.name}: the power of single motors is not there, only "
                "battery_state: set measurement.source: total_only in robot.yaml"
            )
        for item in motors:
            self._on(self._required(item.topic), self._power(item))
        for item in total_topics(self.robot):
            found = self._required if not motors else self._found
            self._on(found(item.topic), self._power(item))
        self._on(self._found(_COMMANDS), self._command)
        self._on(self._found(_IMU), self._imu)

    def read(self) -> None:
        """Take all messages; what cannot be used is counted and left out."""
        for topic, _, message, receive_ns in self.recording.messages(self.takers):
            for taker in self.takers[topic]:
                try:
                    taker(message, receive_ns)
                except MALFORMED as error:
                    self._complain(f"{topic}: {one_line(error)}")
        for name, series in self.streams().items():
            series.finish(f"{self.recording.name}: {name}", jumps=True)
        # Nobody commands for minutes: that is no jump.
        self.commands.finish(f"{self.recording.name}: {_COMMANDS}", jumps=False)

    def _complain(self, problem: str) -> None:
        if problem not in self.complaints and len(self.complaints) >= _MOST_KINDS:
            problem = "further problems of other kinds"
        self.complaints[problem] = self.complaints.get(problem, 0) + 1

    def streams(self) -> Mapping[str, Series]:
        """The sensors' streams by name; commands come when they like."""
        names = [f"{name}/power" for name in self.robot.wheel_topics]
        named = zip([*names, TOTAL_TOPIC], self.supplies, strict=True)
        return {_ENCODERS: self.encoders, **dict(named), _IMU: self.imu}

    def _found(self, topic: str) -> str | None:
        return resolve_topic(self.recording, topic, self.namespace)

    def _required(self, topic: str) -> str:
        return require_topic(self.recording, topic, self.namespace)

    def _on(self, topic: str | None, taker: Taker) -> None:
        if topic is not None:
            self.takers.setdefault(topic, []).append(taker)

    def _joints(self, message: Any, receive_ns: int) -> None:
        for stamp, found in self._wheels.samples(message, stamp_of(message, receive_ns)):
            self.encoders.add(stamp, receive_ns, *found.position, *found.velocity)

    def _command(self, message: Any, receive_ns: int) -> None:
        stamp = stamp_of(message, receive_ns, fallback=True)
        self.commands.add(stamp, receive_ns, *twist_of(message))

    def _imu(self, message: Any, receive_ns: int) -> None:
        rate, force = self._inertial.read(message)
        if math.isfinite(rate[2]):
            self.imu.add(stamp_of(message, receive_ns), receive_ns, *rate, *force)

    def _power(self, source: PowerTopic) -> Taker:
        def take(message: Any, receive_ns: int) -> None:
            for item in source.read(message, receive_ns):
                series = self.supplies[item.wheel]
                series.add(item.stamp_ns, receive_ns, item.power, item.current, item.voltage)

        return take


def read_drive(path: Path, robot: Robot, namespace: str | None = None) -> Drive:
    """Read one recording. Raises InputError where encoders or power are missing."""
    with open_recording(path) as recording:
        collector = _Collector(recording, robot, namespace)
        collector.find()
        collector.read()
        if not len(collector.encoders):
            raise InputError(_no_encoders(recording, robot, collector))
        notes = [recording.warning] if recording.warning else []
    notes += [*_clock_notes(path, collector.streams()), *_notes(path, collector)]
    start = collector.encoders.first
    encoder_time, encoders = collector.encoders.since(start)
    if encoder_time[-1] > limits().drive_seconds:
        too_large(str(path), f"it lasts {encoder_time[-1]:,.0f} s", "drive_seconds")
    encoder_time, jitters = dejitter(encoder_time, encoders[:, :WHEELS])
    on_grid = even if jitters else np.asarray
    supplies = [series.since(start) for series in collector.supplies]
    times = [on_grid(time) for time, _ in supplies]
    if jitters:
        times = _snapped(times)
    rows = [rows for _, rows in supplies]
    powers, at_nominal = zip(*(_drawn(row, robot) for row in rows[:TOTAL]), strict=True)
    if any(at_nominal):
        volts = robot.supply.nominal_voltage
        notes.append(f"{path}: currents are compared, at supply.nominal_voltage = {volts:g} V")
    power_time, motors = _merged(
        times[:TOTAL],
        [
            np.column_stack([power, np.where(np.isnan(row[:, 1]), power, row[:, 1]), row[:, 2]])
            for power, row in zip(powers, rows[:TOTAL], strict=True)
        ],
    )
    command_time, command = _in_force(*collector.commands.since(start), encoder_time[-1])
    imu_time, inertial = collector.imu.since(start)
    if not len(power_time) and not len(times[TOTAL]):
        raise InputError(_no_power(path, collector))
    return Drive(
        name=path.name or str(path),
        encoder_time=encoder_time,
        position=encoders[:, :WHEELS],
        velocity=encoders[:, WHEELS:],
        power_time=power_time,
        power=motors[:, :, 0],
        reading=motors[:, :, 1],
        voltage=motors[:, :, 2],
        total_time=times[TOTAL],
        total=rows[TOTAL][:, 0],
        total_voltage=rows[TOTAL][:, 2],
        command_time=on_grid(command_time),
        command=command,
        imu_time=on_grid(imu_time),
        inertial=inertial,
        start_ns=start,
        notes=tuple(notes),
    )


def _in_force(time: Array, command: Array, end: float) -> tuple[Array, Array]:
    """The commands that can have moved the robot: those of another epoch only where all are."""
    near = (time > -_AROUND) & (time < end + _AROUND)
    return (time[near], command[near]) if near.any() else (time, command)


def _drawn(rows: Array, robot: Robot) -> tuple[Array, bool]:
    """What a supply draws, [A] for motor currents, else [W], and whether at the nominal voltage.

    `drive.sources` says why.
    """
    power, current = rows[:, 0], rows[:, 1]
    if robot.measurement.quantity == "motor_current":
        return current, False
    if np.isfinite(power).any() or not len(power):
        return power, False
    return robot.supply.nominal_voltage * current, True


def _no_encoders(recording: Recording, robot: Robot, collector: _Collector) -> str:
    seen = next(iter(collector.complaints), "no joint_states message")
    return (
        f"{recording.path}: no encoder sample of {', '.join(robot.wheel_names)} ({seen}): "
        "this robot.yaml belongs to another robot, or set robot.wheel_names"
    )


def _no_power(path: Path, collector: _Collector) -> str:
    seen = next(iter(collector.complaints), None)
    if seen is None:
        return f"{path}: no power was measured: record the power topics too"
    return f"{path}: no power was measured: {seen}: mend its driver, and record again"


def _notes(path: Path, collector: _Collector) -> list[str]:
    notes = [
        f"{path}: {text} ({counted(count, 'message')})"
        for text, count in collector.complaints.items()
    ]
    series = (collector.encoders, *collector.supplies)
    dropped, strays = sum(one.dropped for one in series), sum(one.strays for one in series)
    if dropped:
        notes.append(f"{path}: {dropped} samples repeat or precede an earlier stamp: left out")
    if strays:
        notes.append(f"{path}: {strays} samples are stamped far from all others: left out")
    return notes


def _clock_notes(path: Path, streams: Mapping[str, Series]) -> list[str]:
    """What to say of a clock that all sensors share. Raises InputError where they have several."""
    fast = {name: series.fast() for name, series in streams.items() if len(series) > 1}
    known = {name: value for name, value in fast.items() if abs(value) < _NO_CLOCK}
    if not known:
        return []
    least, most = min(known, key=known.__getitem__), max(known, key=known.__getitem__)
    apart = known[most] - known[least]
    if apart > _CLOCK_OFF:
        raise InputError(
            f"{path}: the clock of {most} runs {100.0 * apart:.1f} % faster than that of {least}: "
            "stamp both by one clock, and record again"
        )
    off = float(np.median(list(known.values())))
    if abs(off) < _CLOCK_OFF:
        return []
    way = "fast" if off > 0.0 else "slow"
    return [
        f"{path}: the stamps' clock runs {100.0 * abs(off):.1f} % {way} against the recorder's: "
        "where that is right, speeds and energies are off by as much"
    ]


def _snapped(times: Sequence[Array]) -> list[Array]:
    """Times of several supplies, those that nearly agree made one.

    What is sampled at once and stamped one by one lies on grids that differ by microseconds.
    """
    joined = np.sort(np.concatenate(times))
    if not len(joined):
        return list(times)
    number = np.concatenate([[0], np.cumsum(np.diff(joined) > _TOGETHER)])
    middle = np.bincount(number, weights=joined) / np.bincount(number)
    place = [number[np.searchsorted(joined, time)] for time in times]
    unique = [len(np.unique(found)) == len(found) for found in place]
    if not all(unique) or len(joined) == len(middle):
        return list(times)
    return [middle[found] for found in place]


def _merged(times: Sequence[Array], rows: Sequence[Array]) -> tuple[Array, Array]:
    """Series of the wheels on one time axis, (m, 3, 3), NaN where a wheel has no sample."""
    every = np.unique(np.concatenate(times))
    merged = np.full((len(every), WHEELS, 3), np.nan)
    for wheel, (time, own) in enumerate(zip(times, rows, strict=True)):
        merged[np.searchsorted(every, time), wheel] = own
    return every, merged
