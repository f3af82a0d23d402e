"""Recordings of the same commands, and of others."""

from collections.abc import Callable

import pytest
from attrs import evolve

from tomr_power_model.drive.commands import shift_between
from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import shipped_robot


def test_the_shift_between_recordings_of_the_same_commands(
    make_drive: Callable[..., Drive],
) -> None:
    drive = make_drive(shipped_robot("reference"))
    later = evolve(drive, command_time=drive.command_time + 0.7)
    assert shift_between(drive, later) == pytest.approx(0.7, abs=1e-6)
    assert shift_between(drive, evolve(drive, command=drive.command[::-1])) is None
