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


@pytest.mark.parametrize(("axis", "most"), [(0, 0.5), (2, 2.0)])  # m/s, rad/s
def test_a_stick_that_moves_slowly_may_lose_one(
    axis: int, most: float, drive: Drive, robot: Robot
) -> None:
    command = np.zeros_like(drive.command)
    command[:, axis] = most * np.sin(0.6 * drive.command_time)
    assert lost_commands(less(evolve(drive, command=command), 5), robot) == []


def test_stamps_that_jitter_lose_nothing(drive: Drive, robot: Robot) -> None:
    jitter = 0.002 * (-1.0) ** np.arange(len(drive.command_time))
    command = np.zeros_like(drive.command)
    command[:, 0] = 0.7 * (-1.0) ** (np.arange(len(command)) // 2)
    found = evolve(drive, command_time=drive.command_time + jitter, command=command)
    assert lost_commands(found, robot) == []


def sent_after(steps: np.ndarray, drive: Drive) -> Drive:
    """Commands that differ, so long [s] after one another."""
    time = np.cumsum(steps)
    time = time[time < drive.duration]
    command = np.zeros((len(time), 3))
    command[:, 0] = 0.3 * (-1.0) ** np.arange(len(time))
    return evolve(drive, command_time=time, command=command)


def test_a_sender_without_a_rate_loses_nothing(drive: Drive, robot: Robot) -> None:
    steps = np.random.default_rng(3).uniform(PERIOD, 1.8 * PERIOD, 200)
    assert lost_commands(sent_after(steps, drive), robot) == []


def test_a_sender_that_sends_what_changes_loses_nothing(drive: Drive, robot: Robot) -> None:
    periods = np.random.default_rng(3).integers(2, 12, 100)
    periods[::8] = 1
    assert lost_commands(sent_after(PERIOD * periods, drive), robot) == []
    none = evolve(drive, command_time=np.empty(0), command=np.empty((0, 3)))
    assert lost_commands(none, robot) == []


def test_a_recording_without_most_commands_is_refused(drive: Drive, robot: Robot) -> None:
    dice = np.random.default_rng(3)
    rows = np.flatnonzero(dice.random(len(drive.command_time)) < 0.6)
    changing = drive.command * (1.0 + dice.random((len(drive.command), 1)))
    with pytest.raises(InputError, match="cmd_vel: messages are missing where the command"):
        cleaned(less(evolve(drive, command=changing), *rows), robot)
