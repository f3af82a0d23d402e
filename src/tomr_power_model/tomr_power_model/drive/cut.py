"""Recordings by name, and what is left out of them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.files.paths import real_path

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Skips = Mapping[str, Sequence[tuple[float, float]]]


def names_of(paths: Sequence[Path]) -> list[str]:
    """What to call each recording: its last part, with its folder where two are called alike."""
    short = [real_path(path).name for path in paths]
    names = [
        "/".join(real_path(path).parts[-2:]) if short.count(name) > 1 else name
        for path, name in zip(paths, short, strict=True)
    ]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputError(f"{min(twice)} is given twice: give each recording once")
    return names


def skips_of(given: Sequence[str], bags: Sequence[Path]) -> Skips:
    """What `--skip BAG=FROM:TO` leaves out. Raises InputError for what names no recording."""
    found: dict[str, list[tuple[float, float]]] = {}
    names = names_of(bags)
    for text in given:
        name, _, interval = text.rpartition("=")
        start, _, end = interval.partition(":")
        try:
            limits = float(start), float(end)
        except ValueError:
            raise InputError(f"--skip {text}: give BAG=FROM:TO in seconds") from None
        if name not in names:
            raise InputError(f"--skip {text}: no recording {name}: {', '.join(names)} are given")
        found.setdefault(name, []).append(limits)
    return found


def without(drive: Drive, intervals: Sequence[tuple[float, float]]) -> Drive:
    """A recording without some intervals [s]. Raises InputError if nothing is left."""

    def kept(time: Array) -> Mask:
        keep = np.ones(len(time), dtype=bool)
        for start, end in intervals:
            keep &= (time < start) | (time > end)
        return keep

    if not intervals:
        return drive
    encoders = kept(drive.encoder_time)
    if np.count_nonzero(encoders) < 2:
        raise InputError(f"--skip {drive.name}: nothing is left: leave the recording out")
    left = evolve(
        drive,
        encoder_time=drive.encoder_time[encoders],
        position=drive.position[encoders],
        velocity=drive.velocity[encoders],
    )
    return measured_when(left, kept)


def measured_when(drive: Drive, kept: Callable[[Array], Mask]) -> Drive:
    """A recording with the measurements of power and gyro of some times alone."""
    power, total, imu = (
        kept(time) for time in (drive.power_time, drive.total_time, drive.imu_time)
    )
    return evolve(
        drive,
        power_time=drive.power_time[power],
        power=drive.power[power],
        reading=drive.reading[power],
        voltage=drive.voltage[power],
        total_time=drive.total_time[total],
        total=drive.total[total],
        total_voltage=drive.total_voltage[total],
        imu_time=drive.imu_time[imu],
        inertial=drive.inertial[imu],
    )
