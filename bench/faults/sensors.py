"""The same drives as other sensors would have recorded them: how much do these matter?"""

import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from attrs import frozen
from tqdm import tqdm

from faults.recordings import Recordings
from tomr_power_model.recordings import RecordingWriter, open_recording

_KINDS = ("healthy", "healthy_long", "drives")
_COUNTS = 256
_CURRENT, _NOISE, _VOLTAGE = 0.1, 0.03, 0.1  # A, A, V
Random = np.random.Generator


@frozen
class Message:
    """One message, and how many came before it on its topic."""

    topic: str
    content: Any
    number: int

    @property
    def is_encoder(self) -> bool:
        """Angles and speeds of the wheels."""
        return self.topic.endswith("joint_states")

    @property
    def is_power(self) -> bool:
        """Of a motor, or of the whole robot."""
        return self.topic.endswith(("/power", "battery_state"))


Sensors = Callable[[Message, Random], bool]  # changes a message; whether there is any
SENSORS: dict[str, Sensors] = {}


def _sensors(function: Sensors) -> Sensors:
    SENSORS[function.__name__.replace("_", "-")] = function
    return function


@_sensors
def slow(message: Message, _: Random) -> bool:
    """Encoders at 33 Hz and power at 10 Hz: every third and fifth message that came."""
    every = 3 if message.is_encoder else 5 if message.is_power else 1
    return message.number % every == 0


@_sensors
def coarse_currents(message: Message, random: Random) -> bool:
    """Motors' currents in steps of 0.1 A with 0.03 A of noise, their voltages of 0.1 V."""
    if message.topic.endswith("/power"):
        content = message.content
        noisy = content.current + random.normal(0.0, _NOISE)
        content.current = _CURRENT * round(noisy / _CURRENT)
        content.voltage = _VOLTAGE * round(content.voltage / _VOLTAGE)
    return True


@_sensors
def coarse_encoders(message: Message, _: Random) -> bool:
    """Encoders of 256 counts a wheel turn, without speeds."""
    if message.is_encoder:
        step = 2.0 * np.pi / _COUNTS
        message.content.position = step * np.floor(np.asarray(message.content.position) / step)
        message.content.velocity = np.zeros(0)
    return True


@_sensors
def currents_alone(message: Message, _: Random) -> bool:
    """No voltage is known, neither the motors' nor the robot's."""
    if message.is_power:
        message.content.voltage = float("nan")
    return True


@_sensors
def magnitudes(message: Message, _: Random) -> bool:
    """Motors' currents without their signs, `measurement.signed: false`."""
    if message.topic.endswith("/power"):
        message.content.current = abs(message.content.current)
    return True


def record(recordings: Recordings, kind: str, folder: Path) -> Path:
    """Write the set as other sensors record it; returns what TOMR_RECORDINGS is to be then."""
    change, robot = SENSORS[kind], Path("faults") / recordings.robot
    there = folder / recordings.folder.name
    bags = [bag for group in _KINDS for bag in recordings.drives(group)]
    for drive in tqdm(bags, desc=kind, unit="drive"):
        new = there / drive.bag.relative_to(recordings.folder)
        if not new.exists():
            _record(drive.bag, change, new)
    shutil.copytree(recordings.truth, there / recordings.truth.name, dirs_exist_ok=True)
    shutil.copy(recordings.scorer, there)
    described = yaml.safe_load(recordings.description.read_text(encoding="utf-8"))
    if kind == "magnitudes":
        described["/**"]["ros__parameters"]["measurement"] = {"signed": False}
    (there / robot / "robot.yaml").write_text(yaml.safe_dump(described), encoding="utf-8")
    return folder


def _record(bag: Path, change: Sensors, new: Path) -> None:
    seen: Counter[str] = Counter()
    random = np.random.default_rng(5)
    with open_recording(bag) as recording, RecordingWriter(new) as writer:
        for topic, type_name, content, receive_ns in recording.messages():
            if change(Message(topic, content, seen[topic]), random):
                writer.write(topic, type_name, content, receive_ns)
            seen[topic] += 1
