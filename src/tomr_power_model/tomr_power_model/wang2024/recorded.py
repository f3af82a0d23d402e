"""Samples for a fit out of a recording, tick by tick as the model stage sees them."""

from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.errors import InputError
from tomr_power_model.messages.intake import Unusable, WheelFinder, battery_of, stamp_of
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow
from tomr_power_model.model.ticks import TickSettings, to_ns
from tomr_power_model.recordings import Recording, require_topic, resolve_topic
from tomr_power_model.robot import Robot
from tomr_power_model.wang2024.fit import Samples

Array = NDArray[np.float64]
Series = list[tuple[int, float]]  # stamp [ns], power [W]

_STALE = to_ns(0.5)


def read_samples(
    recording: Recording,
    robot: Robot,
    namespace: str | None = None,
    encoder_window: int = to_ns(0.07),
    period: int = TickSettings().period,
) -> Samples:
    """Wheel motion from the encoders and measured power, one row per tick; NaN where missing.

    Times in nanoseconds. Raises InputError where the recording has no power of every motor.
    """
    if robot.measurement.source != "battery_state" or robot.measurement.quantity != "power":
        raise InputError(
            f"{recording.name}: a fit of wang2024 needs the power of each motor: robot.yaml has "
            f"measurement.source = {robot.measurement.source}, "
            f"measurement.quantity = {robot.measurement.quantity}"
        )
    joints = require_topic(recording, "joint_states", namespace)
    motors = [require_topic(recording, f"{t}/power", namespace) for t in robot.wheel_topics]
    total = None
    if robot.measurement.total == "battery_state":
        total = resolve_topic(recording, "battery_state", namespace)
    encoders = _Encoders(robot)
    supplies: dict[str, Series] = {topic: [] for topic in (*motors, total) if topic is not None}
    takers: dict[str, Callable[[Any, int], None]] = {joints: encoders.take}
    takers.update({topic: _supply_taker(series) for topic, series in supplies.items()})
    for topic, _, message, receive_ns in recording.messages(takers):
        try:
            takers[topic](message, receive_ns)
        except Unusable:
            continue  # as the stages do
    ticks = encoders.ticks(period)
    return Samples(
        encoders.motion(ticks, encoder_window, period),
        np.stack([_means(supplies[topic], ticks, period) for topic in motors], axis=1),
        None if total is None else _means(supplies[total], ticks, period),
    )


class _Encoders:
    """The wheel encoders of a recording."""

    def __init__(self, robot: Robot) -> None:
        self._wheels = WheelFinder(robot.wheel_names)
        self._samples: list[EncoderSample] = []

    def take(self, message: Any, receive_ns: int) -> None:
        found = self._wheels.read(message)
        stamp = stamp_of(message, receive_ns)
        if stamp > 0 and (not self._samples or stamp > self._samples[-1].stamp_ns):
            self._samples.append(EncoderSample(stamp, found.position, found.velocity))

    def ticks(self, period: int) -> range:
        """Stamps of the grid from the first sample to the last."""
        if not self._samples:
            return range(0)
        first = self._samples[0].stamp_ns // period + 1
        return range(first * period, self._samples[-1].stamp_ns + 1, period)

    def motion(self, ticks: range, span: int, period: int) -> WheelMotion:
        """Speed and acceleration in the middle of the window that ends at each tick."""
        window = EncoderWindow(span, period, _STALE)
        waiting = iter(self._samples)
        following = next(waiting, None)
        speed, acceleration = np.full((len(ticks), 3), np.nan), np.full((len(ticks), 3), np.nan)
        for row, tick in enumerate(ticks):
            while following is not None and following.stamp_ns <= tick:
                window.add(following)
                following = next(waiting, None)
            estimate = window.at(tick)
            speed[row], acceleration[row] = estimate.speed, estimate.acceleration
        return WheelMotion(speed, acceleration)


def _supply_taker(series: Series) -> Callable[[Any, int], None]:
    def take(message: Any, receive_ns: int) -> None:
        voltage, current = battery_of(message)
        stamp = stamp_of(message, receive_ns)
        if stamp > 0 and (not series or stamp > series[-1][0]):
            series.append((stamp, -voltage * current))

    return take


def _means(series: Series, ticks: range, period: int) -> Array:
    """Mean power in (tick - period, tick], NaN where there is none."""
    stamps = [stamp for stamp, _ in series]
    powers = np.array([power for _, power in series])
    means = np.full(len(ticks), np.nan)
    for row, tick in enumerate(ticks):
        low, high = bisect_right(stamps, tick - period), bisect_right(stamps, tick)
        if high > low:
            means[row] = powers[low:high].mean()
    return means
