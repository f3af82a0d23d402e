"""Drives as other sensors would have recorded them: how much do these matter?"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from attrs import frozen

from tomr_power_model.recordings import RecordingWriter, open_recording

_LOST = 0.02
_AVERAGED = 25  # samples
_CURRENT, _NOISE, _VOLTAGE = 0.1, 0.03, 0.1  # A, A, V
Random = np.random.Generator


@frozen
class Message:
    """One message, and how many came before it on its topic."""

    topic: str
    content: Any
    number: int
    lately: Sequence[float] = ()  # currents of the last samples on it, and of this one [A]

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
def encoders_20_hz(message: Message, _: Random) -> bool:
    """Encoders at 20 Hz: every fifth message that came."""
    return not message.is_encoder or message.number % 5 == 0


@_sensors
def encoders_10_hz(message: Message, _: Random) -> bool:
    """Encoders at 10 Hz: every tenth message that came."""
    return not message.is_encoder or message.number % 10 == 0


@_sensors
def averaging(message: Message, _: Random) -> bool:
    """Sensors of power that average over 25 samples, half a second."""
    if message.is_power:
        message.content.current = sum(message.lately) / len(message.lately)
    return True


@_sensors
def coarse_currents(message: Message, random: Random) -> bool:
    """Motors' currents in steps of 0.1 A with 0.03 A of noise, their voltages of 0.1 V."""
    if message.topic.endswith("/power"):
        _made_coarse(message.content, random)
    return True


def _made_coarse(content: Any, random: Random) -> None:
    noisy = content.current + random.normal(0.0, _NOISE)
    content.current = _CURRENT * round(noisy / _CURRENT)
    content.voltage = _VOLTAGE * round(content.voltage / _VOLTAGE)


@_sensors
def coarse_everywhere(message: Message, random: Random) -> bool:
    """As `coarse_currents`, the robot's own current and voltage as well."""
    if message.is_power:
        _made_coarse(message.content, random)
    return True


@_sensors
def motor_encoders(message: Message, _: Random) -> bool:
    """Encoders of 64 counts a motor turn at a gear of 15, without speeds."""
    return _counted(message, 960)


@_sensors
def coarse_encoders(message: Message, _: Random) -> bool:
    """Encoders of 256 counts a wheel turn, without speeds."""
    return _counted(message, 256)


def _counted(message: Message, counts: int) -> bool:
    if message.is_encoder:
        step = 2.0 * np.pi / counts
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


@_sensors
def lost(_: Message, random: Random) -> bool:
    """Two messages in a hundred are lost, of each topic."""
    return bool(random.random() >= _LOST)


def record(bag: Path, kind: str, new: Path) -> None:
    """Write a recording as sensors of a kind would have made it; one that is there is kept."""
    if new.exists():
        return
    change, seen = SENSORS[kind], Counter[str]()
    currents: dict[str, deque[float]] = {}
    random = np.random.default_rng(5)
    with open_recording(bag) as recording, RecordingWriter(new) as writer:
        for topic, type_name, content, receive_ns in recording.messages():
            lately = currents.setdefault(topic, deque(maxlen=_AVERAGED))
            if hasattr(content, "current"):
                lately.append(content.current)
            if change(Message(topic, content, seen[topic], tuple(lately)), random):
                writer.write(topic, type_name, content, receive_ns)
            seen[topic] += 1


def describe(robot: Path, kind: str, new: Path) -> None:
    """Write the robot.yaml that goes with them."""
    described = yaml.safe_load(robot.read_text(encoding="utf-8"))
    if kind == "magnitudes":
        parameters = described["/**"]["ros__parameters"]
        parameters.setdefault("measurement", {})["signed"] = False
    new.write_text(yaml.safe_dump(described), encoding="utf-8")
