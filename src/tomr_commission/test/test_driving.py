"""A robot that is driven: slowly first, and stopped where it does otherwise than commanded."""

import math

import numpy as np
import pytest

from tomr_commission.driving import (
    STILL,
    Command,
    DriveChoice,
    DriveWatch,
    reach,
    schedule,
)
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.mission import Plan
from tomr_sim_bridge.missions.schema import Twist, TwistPhase

ROBOT = shipped_robot("reference")
NAN3 = (math.nan,) * 3
AHEAD, TURNING = (0.4, 0.0, 0.0), (0.0, 0.3, 0.3)
PLAN = Plan((TwistPhase(AHEAD, 2.0), TwistPhase(TURNING, 3.0)), 10.0)


def test_the_first_part_is_driven_slowly_between_pauses() -> None:
    commands, slow_end = schedule(PLAN, DriveChoice(slowly=0.25, slow_seconds=3.0, pause=1.0))
    twists = [command.twist for command in commands]
    assert np.allclose(np.diff([command.time for command in commands]), 0.1)
    assert slow_end == 4.0
    assert twists[:10] == [STILL] * 10
    assert twists[10] == (0.1, 0.0, 0.0)
    assert twists[39] == (0.0, 0.25 * 0.3, 0.25 * 0.3)
    assert twists[40:50] == [STILL] * 10
    assert twists[50:100] == [AHEAD] * 20 + [TURNING] * 30
    assert twists[100:] == [STILL] * 11


def test_a_plan_shorter_than_the_slow_part_is_driven_slowly_as_a_whole() -> None:
    _, slow_end = schedule(PLAN, DriveChoice(slow_seconds=60.0, pause=1.0))
    assert slow_end == 6.0


def test_how_far_it_gets() -> None:
    quarter = math.pi / 2.0
    commands = [
        Command(0.0, (1.0, 0.0, 0.0)),
        Command(2.0, (0.0, 0.0, quarter)),
        Command(3.0, (1.0, 0.0, 0.0)),  # to the left now
        Command(4.0, STILL),
    ]
    assert reach(commands) == pytest.approx(math.hypot(2.0, 1.0))


def driven(
    gain: np.ndarray, twist: Twist = AHEAD, until: float = 4.0, reports_speed: bool = True
) -> DriveWatch:
    """Still for 1 s, then commanded; the wheels turn so many times as fast, at 100 Hz."""
    watch = DriveWatch(ROBOT, DriveChoice())
    speed = twist_to_wheels(ROBOT) @ twist * gain
    angle = np.zeros(3)
    for number in range(round(100 * until)):
        time = 0.01 * number
        if number % 5 == 0:
            watch.command(time, STILL if time < 1.0 else twist)
        now = speed if time >= 1.1 else np.zeros(3)
        angle = angle + 0.01 * now
        one, two, three = angle.tolist()
        a, b, c = now.tolist() if reports_speed else NAN3
        watch.encoders(time, time, (one, two, three), (a, b, c))
        assert watch.problem(time, 0.01) == ""
    return watch


@pytest.mark.parametrize("reports_speed", [True, False])
@pytest.mark.parametrize("twist", [AHEAD, TURNING])
def test_a_robot_that_does_as_commanded(twist: Twist, reports_speed: bool) -> None:
    watch = driven(np.array([0.9, 1.1, 1.0]), twist, reports_speed=reports_speed)
    assert list(watch.mistakes()) == []


@pytest.mark.parametrize("reports_speed", [True, False])
def test_a_wheel_that_turns_the_other_way_is_named(reports_speed: bool) -> None:
    (mistake,) = driven(np.array([1.0, 1.0, -1.0]), TURNING, reports_speed=reports_speed).mistakes()
    assert mistake == "wheel_3_joint turns -1.00 times as fast as commanded"


def test_a_wheel_that_hardly_had_to_turn_is_not_judged() -> None:
    assert list(driven(np.array([1.0, -1.0, 1.0]), until=1.45).mistakes()) == []


def test_encoders_that_fall_silent() -> None:
    watch = driven(np.ones(3))
    assert watch.problem(4.0, 0.4) == ""
    assert watch.problem(4.0, 0.6).startswith("joint_states: nothing for 0.6 s")


def test_a_robot_that_stands_though_commanded() -> None:
    with pytest.raises(AssertionError, match="does not follow cmd_vel: see to e-stop"):
        driven(np.full(3, 0.1))
    assert driven(np.full(3, 0.1), until=2.4).problem(2.4, 0.01) == ""
    assert driven(np.array([0.0, 1.0, 1.0]), TURNING) is not None  # one wheel is for the diagnosis


def test_a_robot_that_runs_away() -> None:
    with pytest.raises(AssertionError, match="wheels turn faster than commanded"):
        driven(np.full(3, 2.0))


def test_one_wild_sample_is_not_running_away() -> None:
    watch = driven(np.ones(3))
    one, two, three = (twist_to_wheels(ROBOT) @ AHEAD).tolist()
    for number in range(100):
        time = 4.0 + 0.01 * number
        watch.encoders(time, time, NAN3, (one, 90.0 if number == 1 else two, three))
        assert watch.problem(time, 0.01) == ""


def test_what_was_fast_long_ago_excuses_nothing() -> None:
    watch = driven(np.ones(3))
    one, two, three = (twist_to_wheels(ROBOT) @ AHEAD).tolist()
    found = set()
    for number in range(300):
        time = 4.0 + 0.01 * number
        watch.command(time, (0.1 + 1e-4 * number, 0.0, 0.0))
        watch.encoders(time, time, NAN3, (one, two, three))
        found.add(watch.problem(time, 0.01)[:11])
    assert found == {"", "wheels turn"}


def test_slowing_down_is_not_running_away() -> None:
    watch = driven(np.ones(3))
    speed = twist_to_wheels(ROBOT) @ AHEAD
    for number in range(200):
        time = 4.0 + 0.01 * number
        watch.command(time, STILL)
        one, two, three = (speed * max(0.0, 1.0 - number / 100.0)).tolist()
        watch.encoders(time, time, NAN3, (one, two, three))
        assert watch.problem(time, 0.01) == ""


def test_samples_that_come_in_bursts_are_told_apart_by_their_stamps() -> None:
    watch = DriveWatch(ROBOT, DriveChoice())
    speed = twist_to_wheels(ROBOT) @ AHEAD
    watch.command(0.0, AHEAD)
    for number in range(400):
        stamp = 0.01 * number
        arrival = 0.05 * (number // 5) + 1e-4 * (number % 5)  # five at once
        one, two, three = (speed * stamp).tolist()
        watch.encoders(arrival, stamp, (one, two, three), NAN3)
        assert watch.problem(arrival, 0.01) == ""
    assert list(watch.mistakes()) == []


def test_a_robot_that_stands_from_the_very_start_on() -> None:
    watch = DriveWatch(ROBOT, DriveChoice())
    watch.command(0.0, AHEAD)
    for number in range(200):
        watch.encoders(0.01 * number, 0.01 * number, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert watch.problem(1.505, 0.01).startswith("the robot does not follow cmd_vel")
