"""Commands that were sent and not recorded."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.lost import lost_commands
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot, shipped_robot

PERIOD = 0.05  # s


@pytest.fixture
def robot() -> Robot:
    return shipped_robot("reference")


@pytest.fixture
def drive(make_drive: Callable[..., Drive], robot: Robot) -> Drive:
    """Ahead at 0.3 m/s, the other way every two seconds."""
    made = make_drive(robot)
    time = np.arange(0.0, made.duration, PERIOD)
    command = np.zeros((len(time), 3))
    command[:, 0] = np.where((time + 1e-9) // 2.0 % 2.0 == 0.0, 0.3, -0.3)
    return evolve(made, command_time=time, command=command)


def less(drive: Drive, *rows: int) -> Drive:
    kept = np.setdiff1d(np.arange(len(drive.command_time)), rows)
    return evolve(drive, command_time=drive.command_time[kept], command=drive.command[kept])


def test_all_are_there(drive: Drive, robot: Robot) -> None:
    assert lost_commands(drive, robot) == []
    assert cleaned(drive, robot).notes == drive.notes


def test_a_change_that_came_later_than_it_was_sent_is_left_out(drive: Drive, robot: Robot) -> None:
    found = less(drive, 38, 39, 40, 41)
    assert lost_commands(found, robot) == [pytest.approx((37 * PERIOD, 42 * PERIOD + 1.0))]
    seen = cleaned(found, robot)
    times = seen.encoder_time[(seen.encoder_time > 1.9) & (seen.encoder_time < 3.0)]
    assert len(times) == 0
    assert "cmd_vel: messages are missing where the command changes, 1 times" in seen.notes[-1]


def test_where_nothing_changed_nothing_was_lost(drive: Drive, robot: Robot) -> None:
    assert lost_commands(less(drive, 20, 21, 22, 23), robot) == []


def test_a_stick_that_moves_slowly_may_lose_one(drive: Drive, robot: Robot) -> None:
    command = drive.command.copy()
    command[:, 0] = 0.5 * np.sin(0.6 * drive.command_time)
    assert lost_commands(less(evolve(drive, command=command), 50), robot) == []


def test_a_sender_that_sends_what_changes_loses_nothing(drive: Drive, robot: Robot) -> None:
    dice = np.random.default_rng(3)
    rows = np.sort(dice.choice(len(drive.command_time), 12, replace=False))
    time = np.sort(dice.uniform(0.0, drive.duration, 12))
    seldom = evolve(drive, command_time=time, command=drive.command[rows])
    assert lost_commands(seldom, robot) == []
    none = evolve(drive, command_time=np.empty(0), command=np.empty((0, 3)))
    assert lost_commands(none, robot) == []


def test_a_recording_without_most_commands_is_refused(drive: Drive, robot: Robot) -> None:
    dice = np.random.default_rng(3)
    rows = np.flatnonzero(dice.random(len(drive.command_time)) < 0.6)
    changing = drive.command * (1.0 + dice.random((len(drive.command), 1)))
    with pytest.raises(InputError, match="cmd_vel: messages are missing where the command"):
        cleaned(less(evolve(drive, command=changing), *rows), robot)
