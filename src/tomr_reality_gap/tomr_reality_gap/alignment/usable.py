"""What can be used of a recording, and what must not be explained: faults, dead sensors, clocks
that never meet. None of that is physics which a simulation leaves out.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from tomr_power_model.calibration.calibrate import without
from tomr_power_model.calibration.checks import SENSOR_CHECKS, measured_speed, runs
from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run

Array = NDArray[np.float64]

_MARGIN = 1.0  # s, that a sensor may go on before and after the encoders
_FIRST = 3  # samples
_UNDER_WAY = 1.0  # rad/s: faster than a robot becomes within the first samples
_SETTLING = 1.0  # s
_LONG_AGO = 60.0  # s
_MISSING = 0.02  # of the samples: more are told
_HALF = 0.5  # of the samples: with fewer of a wheel's there is nothing to hold against
_MOVING = 0.3  # rad/s
_SAME = 0.15  # of the fastest wheel's speed
_VARIED = 0.05  # of the motion that must be at other speeds than the usual one
_COMPARED = 0.4  # s, width of the bell over which a wheel's speed is held against its command
_LOST = 1.5  # s: a wheel that does not follow for a shorter time may be slow, which is explained
_ASTRAY = 0.65  # rms difference over rms of what is expected or seen
_WORTH_TELLING = 1.5  # rad/s, rms of what is expected or seen


def usable(recorded: Recorded, robot: Robot) -> Recorded:
    """A recording without what was measured while its encoders were silent, with notes.

    Raises:
        InputError: clocks that do not meet, or a wheel whose encoder tells next to nothing.
    """
    trimmed, notes = _trimmed(recorded)
    notes += _blanks(trimmed, robot)
    settled = _settled(trimmed)
    if settled is not trimmed:
        notes.append(
            f"{recorded.name}: it begins in motion: the first command is taken to have held "
            f"before, the first {_SETTLING:g} s are left out"
        )
    return evolve(settled, notes=(*recorded.notes, *notes))


def refuse_faulty(recordings: Sequence[Recorded], robot: Robot) -> None:
    """Raise InputError with the first fault of a sensor, or sign of another robot, as
    `tomr_calibrate` does.
    """
    for item in recordings:
        for check in SENSOR_CHECKS:
            for found in check(item, robot):
                raise InputError(str(found))


def refuse_dull(recordings: Sequence[Recorded]) -> None:
    """Raise InputError where all motion is at one and the same speed and heading.

    There every friction is a constant: none can be told from another, nor from a motor's values.
    """
    speeds = np.concatenate([measured_speed(item) for item in recordings])
    moving = speeds[np.isfinite(speeds).all(axis=1) & (np.abs(speeds) > _MOVING).any(axis=1)]
    if not len(moving):
        return  # no sample tells all wheels: there is no telling
    usual = np.median(moving, axis=0)
    off = np.abs(moving - usual).max(axis=1) > _SAME * np.abs(usual).max()
    if np.mean(off) < _VARIED:
        names = ", ".join(item.name for item in recordings)
        told = ", ".join(f"{value:.1f}" for value in usual)
        raise InputError(
            f"{names}: the wheels turn at one speed ({told} rad/s) for "
            f"{100.0 * (1.0 - np.mean(off)):.0f} % of the motion, which tells no effect from "
            "another: add drives at other speeds and headings, with starts and stops"
        )


def refuse_unfollowed(simulations: Sequence[RecordingSimulation], simulated: Sequence[Run]) -> None:
    """Raise InputError for a wheel that does not turn as the commands make it: a lost driver or
    encoder, or commands that were not those.

    Args:
        simulations: the recordings.
        simulated: of `RecordingSimulation.run` as described, of each.
    """
    for item, run in zip(simulations, simulated, strict=True):
        for channel in item.channels:
            if channel.kind != "speed" or channel.wheel is None or len(channel.time) < 2:
                continue
            time = channel.time - 0.5 * channel.span
            expected = np.interp(time, item.timeline.middle, run.speed[:, channel.wheel])
            width = _COMPARED / float(np.median(np.diff(time)))
            error = gaussian_filter1d((channel.value - expected) ** 2, width)
            level = gaussian_filter1d(np.maximum(expected**2, channel.value**2), width)
            off = (error > _ASTRAY**2 * level) & (level > _WORTH_TELLING**2)
            for first, last in runs(off, time, _LOST, bridge=_COMPARED):
                rows = slice(first, last + 1)
                seen, wanted = (
                    np.sqrt(np.mean(values[rows] ** 2)) for values in (channel.value, expected)
                )
                raise InputError(
                    f"{item.recorded.name}: {channel.name}, {time[first]:.1f} s to "
                    f"{time[last]:.1f} s: it does not follow its command: it turns at "
                    f"{seen:.1f} rad/s rms, {wanted:.1f} rad/s is expected: a fault, lost "
                    "commands or another robot's description: leave it out with --skip "
                    f"{item.recorded.name}={max(0.0, time[first] - 1.0):.1f}:{time[last] + 1.0:.1f}"
                )


def _trimmed(recorded: Recorded) -> tuple[Recorded, list[str]]:
    first, last = -_MARGIN, recorded.duration + _MARGIN

    def inside(time: Array, what: str) -> NDArray[np.bool_]:
        rows = (time >= first) & (time <= last)
        if len(time) and not rows.any():
            raise InputError(
                f"{recorded.name}: {what} ({time[0]:.1f} to {time[-1]:.1f} s) and encoders (0 to "
                f"{recorded.duration:.1f} s) do not overlap: are both stamped by the same clock?"
            )
        if not rows.all():
            count = len(rows) - np.count_nonzero(rows)
            notes.append(
                f"{recorded.name}: {count} samples of {what} lie outside of the encoders' time: "
                "left out"
            )
        return np.asarray(rows)

    notes: list[str] = []
    power = inside(recorded.power_time, "motor power")
    total = inside(recorded.total_time, "battery_state")
    yaw = inside(recorded.yaw_time, "imu/data")
    if not notes:
        return recorded, notes
    kept = evolve(
        recorded,
        power_time=recorded.power_time[power],
        power=recorded.power[power],
        reading=recorded.reading[power],
        voltage=recorded.voltage[power],
        total_time=recorded.total_time[total],
        total=recorded.total[total],
        total_voltage=recorded.total_voltage[total],
        yaw_time=recorded.yaw_time[yaw],
        yaw_rate=recorded.yaw_rate[yaw],
    )
    return kept, notes


def _settled(recorded: Recorded) -> Recorded:
    """A recording that begins in motion without its beginning, which earlier commands made."""
    early = np.nan_to_num(measured_speed(recorded)[:_FIRST])
    if not len(recorded.command_time) or np.abs(early).max() < _UNDER_WAY:
        return recorded
    before = recorded.command_time[:1] - _LONG_AGO
    yaw = recorded.yaw_time > _SETTLING
    kept = without(recorded, [(-_LONG_AGO, _SETTLING)])
    return evolve(
        kept,
        command_time=np.concatenate([before, kept.command_time]),
        command=np.concatenate([kept.command[:1], kept.command]),
        yaw_time=recorded.yaw_time[yaw],
        yaw_rate=recorded.yaw_rate[yaw],
    )


def _blanks(recorded: Recorded, robot: Robot) -> list[str]:
    """Notes of what is NaN."""
    notes = []
    for wheel, name in enumerate(robot.wheel_names):
        told = np.isfinite(recorded.position[:, wheel]) | np.isfinite(recorded.velocity[:, wheel])
        missing = 1.0 - float(np.mean(told))
        if missing > _HALF:
            raise InputError(
                f"{recorded.name}: {name}: {100.0 * missing:.0f} % of the encoder's samples are "
                "NaN: mend its driver, and record again"
            )
        if missing > _MISSING:
            notes.append(_note(recorded, f"the encoder of {name}", missing))
    for wheel, topic in enumerate(robot.wheel_topics if len(recorded.power_time) else ()):
        own = recorded.power[:, wheel]
        # Topics with stamps of their own leave blanks for each other.
        expected = int(np.isfinite(recorded.power).sum(axis=0).max())
        missing = 1.0 - float(np.isfinite(own).sum()) / max(expected, 1)
        if missing > _MISSING:
            notes.append(_note(recorded, f"{topic}/power", missing))
    return notes


def _note(recorded: Recorded, what: str, share: float) -> str:
    return f"{recorded.name}: {100.0 * share:.0f} % of {what} are NaN: left out"
