"""A recorded drive as arrays to draw: power, residuals, what was true and what was named."""

from collections.abc import Callable
from typing import Any

import numpy as np
from attrs import define, field, frozen
from numpy.typing import NDArray

from tomr_demo.score import DIAGNOSTICS, TRUTH, Scoreboard
from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame, residual_names
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUAL_TOPIC
from tomr_fault_diag.residuals.messages import frame_of
from tomr_power_model.drive.sources import TOTAL_TOPIC
from tomr_power_model.errors import InputError
from tomr_power_model.messages.intake import Unusable, header_stamp_ns
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import Recording, resolve_topic
from tomr_power_model.topics.predictions import TOTAL as TOTAL_PREDICTED

Array = NDArray[np.float64]

POWER = "/power"
PREDICTED = "/power/predicted"


@frozen
class Series:
    """A quantity over time."""

    time: Array  # s since the start of the drive, shape (n,)
    value: Array  # shape (n,)


@frozen
class Power:
    """Power of one supply [W], measured and predicted from the command; empty where absent."""

    name: str
    measured: Series
    predicted: Series


@frozen
class Drive:
    """What a recording says of a drive."""

    start_ns: int
    end: float  # s since the start
    power: tuple[Power, ...]  # the motors in the order of the wheels, then the whole robot
    residual_names: tuple[str, ...]
    residual_time: Array  # s since the start, shape (n,)
    residual_share: Array  # residual / band [-], shape (n, 10); NaN where it is not known
    board: Scoreboard

    def seconds(self, stamp_ns: int) -> float:
        """A stamp [ns] as time since the start [s]."""
        return (stamp_ns - self.start_ns) / NANOSECONDS


@define
class _Samples:
    stamps: list[int] = field(factory=list)
    values: list[float] = field(factory=list)

    def power(self, message: Any, stamp_ns: int) -> None:
        """Take a BatteryState: P = -voltage * current [W]."""
        self.stamps.append(stamp_ns)
        self.values.append(-float(message.voltage) * float(message.current))

    def series(self, start_ns: int) -> Series:
        stamps = np.array(self.stamps, dtype=np.int64) - start_ns
        return Series(stamps / NANOSECONDS, np.array(self.values, dtype=np.float64))


def load_drive(recording: Recording) -> Drive:
    """Read what the figure shows; a topic that was not recorded leaves its part empty.

    Raises InputError if there is no power of any motor.
    """
    wheels = wheels_of(recording)
    supplies = [(wheel, f"{wheel}{POWER}", f"{wheel}{PREDICTED}") for wheel in wheels]
    supplies.append(("whole robot", TOTAL_TOPIC, TOTAL_PREDICTED))
    samples = {topic: _Samples() for _, *pair in supplies for topic in pair}
    takers: dict[str, Callable[[Any, int], None]] = {t: s.power for t, s in samples.items()}
    frames: list[ResidualFrame] = []
    takers[RESIDUAL_TOPIC] = lambda message, stamp: frames.append(frame_of(message, stamp))
    board = Scoreboard()
    for topic in (TRUTH, DIAGNOSTICS):
        takers[topic] = _score(board, topic)
    _read(recording, takers)
    board.close()
    stamps = [stamp for item in samples.values() for stamp in item.stamps]
    start, end = min(stamps), max(stamps)
    return Drive(
        start_ns=start,
        end=(end - start) / NANOSECONDS,
        power=tuple(
            Power(name, samples[measured].series(start), samples[predicted].series(start))
            for name, measured, predicted in supplies
        ),
        residual_names=tuple(
            name.removeprefix("residuals: ")
            for name in residual_names((wheels[0], wheels[1], wheels[2]))
        ),
        residual_time=(np.array([f.stamp_ns for f in frames], np.int64) - start) / NANOSECONDS,
        residual_share=_shares(frames),
        board=board,
    )


def wheels_of(recording: Recording) -> list[str]:
    """Wheel topics such as wheel_1, of which both power and prediction are there."""
    wheels = sorted(
        topic.removesuffix(POWER).strip("/")
        for topic in recording.topics
        if topic.endswith(POWER) and topic.removesuffix(POWER) + PREDICTED in recording.topics
    )
    if len(wheels) != 3:
        raise InputError(
            f"{recording.name}: needs <wheel>/power and <wheel>/power/predicted of three wheels, "
            f"holds {', '.join(recording.topics)}"
        )
    return wheels


def _score(board: Scoreboard, topic: str) -> Callable[[Any, int], None]:
    return lambda message, stamp_ns: board.take(topic, message, stamp_ns)


def _read(recording: Recording, takers: dict[str, Callable[[Any, int], None]]) -> None:
    found: dict[str, Callable[[Any, int], None]] = {}
    for name, take in takers.items():
        topic = resolve_topic(recording, name)
        if topic is not None:
            found[topic] = take
    for topic, _, message, receive_ns in recording.messages(found):
        try:
            found[topic](message, header_stamp_ns(message) or receive_ns)
        except Unusable as error:
            raise InputError(
                f"{recording.name}: {topic}: {error}; record it again with this version"
            ) from None


def _shares(frames: list[ResidualFrame]) -> Array:
    rows = [
        [item.residual / item.band if item.band else np.nan for item in f.residuals] for f in frames
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, RESIDUALS)
