"""Gross mistakes that encoders against commands show."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.mistakes import gross_mistake
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
DESCRIBED = twist_to_wheels(ROBOT, nominal=True)


def _twists() -> np.ndarray:
    return np.random.default_rng(2).uniform(-0.5, 0.5, (300, 3)) * [1.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("matrix", "seen", "remedy"),
    [
        (DESCRIBED * [1.0, 1.0, -1.0], "angular.z of the commands has the wrong sign", "REP 103"),
        (DESCRIBED * [1.0, 1.0, 2.0], "2 times as far out", "robot.robot_radius: 0.4"),
        (0.5 * DESCRIBED, "turn 0.5 times as fast", "robot.wheel_radius: 0.1,"),
        (1.9 * DESCRIBED, "turn 2 times as fast", "robot.wheel_radius: 0.025,"),
        (2.7 * DESCRIBED, "turn 2.7 times as fast", "robot.wheel_radius: 0.0185,"),
        (55.0 * DESCRIBED, "turn 55 times as fast", "joint_states seems to give degrees"),
        (9.5493 * DESCRIBED, "turn 9.55 times as fast", "give revolutions per minute in place of"),
        (10.0 * DESCRIBED, "turn 10 times as fast", "robot.wheel_radius: 0.005,"),
        (DESCRIBED / 6.2832, "turn 0.159 times as fast", "give revolutions in place of radians"),
        (DESCRIBED[[0, 2, 1]], "the order of the wheels", "robot.wheel_names: [wheel_1_joint, "),
    ],
)
def test_a_mistake_is_named_with_its_remedy(matrix: np.ndarray, seen: str, remedy: str) -> None:
    twists = _twists()
    said, mend = gross_mistake(twists, twists @ matrix.T, ROBOT)
    assert seen in said
    assert said.endswith("off as described, 0 % so")
    assert remedy in mend


def test_what_is_a_little_off_or_not_shown_is_no_gross_mistake() -> None:
    twists = _twists()
    for matrix in (DESCRIBED, 1.2 * DESCRIBED, DESCRIBED * [[1.0], [0.6], [1.0]]):
        assert gross_mistake(twists, twists @ matrix.T, ROBOT) == ("", "")
    straight = twists * [1.0, 0.0, 0.0]
    assert gross_mistake(straight, -straight @ DESCRIBED.T, ROBOT) == ("", "")
    nothing = np.full((10, 3), np.nan)
    assert gross_mistake(nothing, nothing, ROBOT) == ("", "")
    still = gross_mistake(twists, 0.0 * twists, ROBOT)  # no wheel answers: a fault
    assert still == ("", "")


def test_a_robot_that_never_turns_shows_what_needs_no_turning() -> None:
    twists = _twists() * [1.0, 1.0, 0.0]
    backwards = DESCRIBED * [[1.0], [-1.0], [1.0]]
    said, _ = gross_mistake(twists, twists @ backwards.T, ROBOT)
    assert said.startswith("the encoder of wheel_2_joint counts against its sense")
    # What it turns by chance drowns in what encoders are off by, and some of what they say is lost.
    noisy = twists @ backwards.T + np.random.default_rng(3).normal(0.0, 0.3, (300, 3))
    noisy[::4, 0] = np.nan
    said, _ = gross_mistake(np.add(twists, [0.0, 0.0, 0.001]), noisy, ROBOT)
    assert said.startswith("the encoder of wheel_2_joint counts against its sense")
    assert gross_mistake(twists, twists @ (DESCRIBED * [1.0, 1.0, -1.0]).T, ROBOT) == ("", "")
    # Half way around is as well all encoders backwards: which, turning would show.
    assert gross_mistake(twists, -twists @ DESCRIBED.T, ROBOT) == ("", "")


def test_a_mixture_of_driving_and_standing_is_no_mistake() -> None:
    """Half of the time stopped, a robot turns half as fast on average."""
    twists = _twists()
    for still in (slice(0, 150), slice(200, 300), slice(0, 300, 2)):
        speed = twists @ DESCRIBED.T
        speed[still] = 0.0
        assert gross_mistake(twists, speed, ROBOT) == ("", "")
    share = np.arange(300)[:, None] % 3  # a third each: still, half as fast, as described
    assert gross_mistake(twists, 0.5 * share * (twists @ DESCRIBED.T), ROBOT) == ("", "")


@pytest.mark.parametrize("degrees", [20.0, 45.0])
def test_what_no_mistake_explains_has_no_name(degrees: float) -> None:
    """A little off, which others find, and far off, between two mistakes."""
    twists = _twists()
    other = evolve(ROBOT, wheel_offset=ROBOT.wheel_offset + np.radians(degrees))
    speed = twists @ twist_to_wheels(other, nominal=True).T
    assert gross_mistake(twists, speed, ROBOT) == ("", "")


@pytest.mark.parametrize("heading", [0.0, 0.4, 1.3, 2.0])
def test_one_direction_shows_no_mistake(heading: float) -> None:
    speed = np.random.default_rng(4).uniform(-0.5, 0.5, (300, 1))
    straight = speed * [np.cos(heading), np.sin(heading), 0.3 * np.sin(5.0 * heading)]
    for signs in ([1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]):
        assert gross_mistake(straight, straight @ DESCRIBED.T * signs, ROBOT) == ("", "")


def test_too_few_samples_say_nothing_and_what_limits_may_be_left_out() -> None:
    twists = _twists()
    assert gross_mistake(twists, -twists @ DESCRIBED.T, ROBOT)[0]
    few = np.where(np.arange(300)[:, None] < 150, twists, np.nan)
    assert gross_mistake(few, -twists @ DESCRIBED.T, ROBOT) == ("", "")
    half = 0.5 * twists @ DESCRIBED.T
    assert "see what changes the commands" in gross_mistake(twists, half, ROBOT)[1]
    assert gross_mistake(twists, half, ROBOT, slower=False) == ("", "")
    near = twists @ (DESCRIBED * [1.0, 1.0, 0.5]).T
    assert "0.5 times as far out" in gross_mistake(twists, near, ROBOT)[0]
    assert gross_mistake(twists, near, ROBOT, slower=False) == ("", "")


def test_what_turns_faster_than_commanded_is_always_a_mistake() -> None:
    """Nothing on a robot's way makes that of all its wheels."""
    twists = _twists()
    motors = tuple(evolve(motor, gear_ratio=15.0) for motor in ROBOT.motors)
    geared = evolve(ROBOT, motors=motors)
    seen, remedy = gross_mistake(twists, 14.5 * twists @ DESCRIBED.T, geared, slower=False)
    assert "14.5 times as fast" in seen
    assert "joint_states seems to give the motor's shaft in place of the wheel" in remedy
    assert gross_mistake(twists, 1.5 * twists @ DESCRIBED.T, geared, slower=False) == ("", "")
