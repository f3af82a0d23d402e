"""What can be used of a recording: not what lies outside of the encoders' time, nor a beginning
that earlier commands made; with a note on everything that is missing.
"""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.cut import measured_when, without
from tomr_power_model.drive.inertial import without_mistaken_imu
from tomr_power_model.drive.lost import lost_commands
from tomr_power_model.drive.motion import measured_speed
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_MARGIN = 1.0  # s, that a sensor may go on before and after the encoders
_FIRST = 3  # samples
_UNDER_WAY = 1.0  # rad/s: faster than a robot becomes within the first samples
_SETTLING = 1.0  # s
_LONG_AGO = 60.0  # s
_MISSING = 0.02  # of the samples: more are noted
_HALF = 0.5  # of the samples: with fewer of a wheel's there is nothing to hold against
_SINGLE = 2.0  # s
_SHORTEST = 10.0  # s


def cleaned(drive: Drive, robot: Robot) -> Drive:
    """A recording without what cannot be used, with notes.

    Raises:
        InputError: too short, clocks that do not meet, no power, an encoder with hardly any
            samples, or too many commands lost.
    """
    _refuse_useless(drive)
    believed, notes = without_mistaken_imu(drive, robot)
    trimmed, said = _trimmed(believed)
    notes += said
    notes += _blanks(trimmed, robot)
    settled = _settled(trimmed)
    if settled is not trimmed:
        notes.append(
            f"{drive.name}: it begins in motion: the first command is taken to have held "
            f"before, the first {_SETTLING:g} s are left out"
        )
    known, left_out = _commanded(settled, robot)
    return evolve(known, notes=(*drive.notes, *notes, *left_out))


def _commanded(drive: Drive, robot: Robot) -> tuple[Drive, list[str]]:
    """A recording without the times in which commands were lost."""
    lost = lost_commands(drive, robot)
    if not lost:
        return drive, []
    known = np.ones(len(drive.encoder_time), dtype=bool)
    for start, end in lost:
        known &= (drive.encoder_time < start) | (drive.encoder_time > end)
    if np.mean(known) < _HALF:
        raise InputError(
            f"{drive.name}: cmd_vel: messages are missing where the command changes, {len(lost)} "
            "times: nothing shows what the robot was asked for; record it again"
        )
    note = (
        f"{drive.name}: cmd_vel: messages are missing where the command changes, {len(lost)} "
        f"times: {100.0 * (1.0 - np.mean(known)):.0f} % of it are left out"
    )
    return without(drive, lost), [note]


def check_duration(drives: tuple[Drive, ...]) -> None:
    """Raise InputError where recordings are too short in all."""
    duration = sum(item.duration for item in drives)
    if duration < _SHORTEST:
        names = ", ".join(item.name for item in drives)
        raise InputError(
            f"{names}: {duration:.1f} s are too short to decide anything: record at least "
            f"{_SHORTEST:g} s, better three minutes"
        )


def _refuse_useless(drive: Drive) -> None:
    if drive.duration < _SINGLE:
        raise InputError(
            f"{drive.name}: {drive.duration:.1f} s are too short for a recording: leave it out"
        )
    if len(drive.command_time):
        first, last = drive.command_time[0], drive.command_time[-1]
        if first > drive.duration or last < 0.0:
            raise _apart(drive, "commands", drive.command_time)
    power = np.concatenate([drive.power.ravel(), drive.total])
    if len(power) and not np.isfinite(power).any():
        raise InputError(
            f"{drive.name}: every power sample is NaN: check the power sensors' driver"
        )


def _apart(drive: Drive, what: str, time: Array) -> InputError:
    return InputError(
        f"{drive.name}: {what} ({time[0]:.1f} to {time[-1]:.1f} s) and encoders (0 to "
        f"{drive.duration:.1f} s) do not overlap: are both stamped by the same clock?"
    )


def _trimmed(drive: Drive) -> tuple[Drive, list[str]]:
    first, last = -_MARGIN, drive.duration + _MARGIN

    def inside(time: Array) -> NDArray[np.bool_]:
        return np.asarray((time >= first) & (time <= last))

    notes: list[str] = []
    streams = {
        "motor power": drive.power_time,
        "battery_state": drive.total_time,
        "imu/data": drive.imu_time,
    }
    for what, time in streams.items():
        rows = inside(time)
        if len(time) and not rows.any():
            raise _apart(drive, what, time)
        if not rows.all():
            notes.append(
                f"{drive.name}: {np.count_nonzero(~rows)} samples of {what} lie outside of the "
                "encoders' time: left out"
            )
    return measured_when(drive, inside) if notes else drive, notes


def _settled(drive: Drive) -> Drive:
    """A recording that begins in motion without its beginning, which earlier commands made."""
    early = np.nan_to_num(measured_speed(drive)[:_FIRST])
    if not len(drive.command_time) or np.abs(early).max() < _UNDER_WAY:
        return drive
    before = drive.command_time[:1] - _LONG_AGO
    kept = without(drive, [(-_LONG_AGO, _SETTLING)])
    return evolve(
        kept,
        command_time=np.concatenate([before, kept.command_time]),
        command=np.concatenate([kept.command[:1], kept.command]),
    )


def _blanks(drive: Drive, robot: Robot) -> list[str]:
    """Notes of what is NaN."""
    notes = []
    for wheel, name in enumerate(robot.wheel_names):
        known = np.isfinite(drive.position[:, wheel]) | np.isfinite(drive.velocity[:, wheel])
        missing = 1.0 - float(np.mean(known))
        if missing > _HALF:
            raise InputError(
                f"{drive.name}: {name}: {100.0 * missing:.0f} % of the encoder's samples are "
                "NaN: mend its driver, and record again"
            )
        if missing > _MISSING:
            notes.append(_note(drive, f"the encoder of {name}", missing))
    for wheel, topic in enumerate(robot.wheel_topics if len(drive.power_time) else ()):
        own = drive.power[:, wheel]
        # Topics with stamps of their own leave blanks for each other.
        expected = int(np.isfinite(drive.power).sum(axis=0).max())
        missing = 1.0 - float(np.isfinite(own).sum()) / max(expected, 1)
        if missing > _MISSING:
            notes.append(_note(drive, f"{topic}/power", missing))
    return notes


def _note(drive: Drive, what: str, share: float) -> str:
    return f"{drive.name}: {100.0 * share:.0f} % of {what} are NaN: left out"
