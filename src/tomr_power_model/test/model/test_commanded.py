"""What commands lead to, tick by tick: in step with the commands, whatever the drivers' rate."""

import math

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.commanded import Commanded, CommandPath, CommandTiming, Seen
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
STILL = Seen((0.0, 0.0, 0.0), (math.nan,) * 3, math.nan)


def _with_rate(rate: float) -> Robot:
    robot = shipped_robot("reference")
    return evolve(robot, controller=evolve(robot.controller, rate=rate))


def _run(robot: Robot, first_ms: float, ticks: int, timeout_ms: int = 0) -> list[Commanded | None]:
    """One command for 0.3 m/s ahead, some time after the base."""
    path = CommandPath(robot, CommandTiming(50 * MS, timeout_ms * MS))
    path.command(BASE + round(first_ms * MS), (0.3, 0.0, 0.0))
    return [path.over(BASE + 50 * k * MS, STILL) for k in range(1, ticks + 1)]


@pytest.mark.parametrize("rate", [10.0, 30.0, 200.0, 1000.0])
def test_drivers_of_any_rate_reach_the_commanded_speed(rate: float) -> None:
    robot = _with_rate(rate)
    last = _run(robot, 1.0, 100)[-1]
    assert last is not None
    np.testing.assert_allclose(last.speed, twist_to_wheels(robot) @ [0.3, 0.0, 0.0], atol=0.15)


@pytest.mark.parametrize("first_ms", [10.0, 11.7, 13.3])
def test_periods_begin_where_commands_come(first_ms: float) -> None:
    """The same step by step, only later."""
    ticks = [item for item in _run(_with_rate(200.0), first_ms, 4) if item is not None]
    starts = [start for item in ticks for start in item.starts]
    assert all((start - BASE - round(first_ms * MS)) % (5 * MS) == 0 for start in starts)
    rows = [row for item in ticks for row in item.rows]
    speeds = [
        row[at.OUT_HEADER + at.OUT_WHEEL + at.OUT_SPEED]
        for start, row in zip(starts, rows, strict=True)
        if start >= BASE + round(first_ms * MS)
    ]
    whole = [
        row[at.OUT_HEADER + at.OUT_WHEEL + at.OUT_SPEED]
        for item in _run(_with_rate(200.0), 0.0, 5)
        if item is not None
        for row in item.rows
    ]
    np.testing.assert_allclose(speeds, whole[: len(speeds)], rtol=1e-12)


def test_a_tick_rests_on_what_came_before_it() -> None:
    for tick, item in enumerate(_run(_with_rate(200.0), 12.0, 8), 1):
        if item is not None:
            assert all(start + 2.5 * MS <= BASE + 50 * tick * MS for start in item.starts)


def test_an_old_command_counts_as_a_stop() -> None:
    held, timed = (_run(_with_rate(200.0), 0.0, 40, timeout)[-1] for timeout in (0, 500))
    assert held is not None
    assert timed is not None
    assert max(map(abs, held.speed)) > 1.0
    assert max(map(abs, timed.speed)) < 0.05


def test_simulated_motion_goes_on_beyond_its_ends() -> None:
    path = CommandPath(_with_rate(200.0), CommandTiming(50 * MS))
    path.command(BASE, (0.3, 0.0, 0.0))
    for k in range(1, 61):
        path.over(BASE + 50 * k * MS, STILL)
    end = BASE + 3000 * MS
    angles, _, speed, _ = path.motion.beside([end, end + 20 * MS], end, 50 * MS)
    np.testing.assert_allclose(angles[1] - angles[0], 0.02 * speed, atol=1e-6)
