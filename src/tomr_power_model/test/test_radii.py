"""Radii and places of wheels that the drivers have otherwise than the description."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.radii import Answer, answer, misdescribed
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot

ROBOT = shipped_robot("reference")
Array = np.ndarray


def _twist(seconds: float = 60.0, period: float = 0.05) -> tuple[Array, Array]:
    """Legs of 3 s: straight ahead, aside, turning on the spot, standing."""
    time = np.arange(0.0, seconds, period)
    legs = np.array([[0.3, 0.0, 0.0], [0.0, -0.4, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    return time, legs[(time // 3.0).astype(int) % 4]


def _answer(drivers: Robot, noise: float = 0.0) -> Answer | None:
    """Of a robot whose drivers have another description than ours."""
    time, twist = _twist()
    random = np.random.default_rng(1)
    measured = twist @ twist_to_wheels(drivers).T
    measured += noise * random.standard_normal(measured.shape)
    return answer(time, measured, twist @ twist_to_wheels(ROBOT).T, ROBOT)


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize(
    ("changes", "seen", "remedy"),
    [
        ({}, "", ""),
        ({"wheel_radius": 0.0501}, "", ""),  # of 0.05 m: 0.2 % are not said
        (
            {"wheel_radius": 0.04},
            "they turn 1.250 times as fast as described",
            "robot.wheel_radius: 0.04,",
        ),
        (
            {"robot_radius": 0.22},
            "where the robot turns, 1.100 times as fast",
            "robot.robot_radius: 0.22,",
        ),
        (
            {"wheel_offset": ROBOT.wheel_offset - 0.1},
            "they drive +5.7 degrees beside the command",
            f"robot.wheel_offset: {ROBOT.wheel_offset - 0.1:.4g}",
        ),
        (
            {"wheel_radius": 0.052, "robot_radius": 0.19},
            "they turn 0.962 times as fast as described, where the robot turns, 0.950 times",
            "robot.wheel_radius: 0.052, robot.robot_radius: 0.19,",
        ),
    ],
)
def test_what_the_drivers_have_is_what_to_write(
    changes: dict[str, float], seen: str, remedy: str, noise: float
) -> None:
    found = _answer(evolve(ROBOT, **changes), noise)
    said, write = misdescribed(found, ROBOT)
    if noise:  # digits may differ, not what is said
        assert bool(said) == bool(seen)
        return
    assert said.startswith(seen)
    assert bool(said) == bool(seen)
    assert remedy in write


def test_only_steady_motion_counts() -> None:
    """Commands that change twice as often as not, and a robot that follows them 0.1 s late."""
    time = np.arange(0.0, 120.0, 0.05)
    speed = np.where(time % 6.0 < 2.0, 0.4, 0.2 + 0.15 * np.sin(4.0 * time))
    twist, late = np.zeros((2, len(time), 3))
    twist[:, 0], late[:, 0] = speed, np.interp(time - 0.1, time, speed)
    expected, measured = (item @ twist_to_wheels(ROBOT).T for item in (twist, late))
    found = answer(time, 1.05 * measured, expected, ROBOT)
    assert found is not None
    assert found.linear == pytest.approx(1.05, abs=1e-3)


def test_what_is_shown_too_little_or_not_alike_says_nothing() -> None:
    time, twist = _twist()
    expected = twist @ twist_to_wheels(ROBOT).T
    fast = 1.08 * expected
    assert misdescribed(answer(time, fast, expected, ROBOT), ROBOT)[0]
    few = slice(0, 50)  # 2.5 s
    short = answer(time[few], fast[few], expected[few], ROBOT)
    assert short is None
    assert misdescribed(short, ROBOT) == ("", "")
    straight = np.abs(twist[:, 2:]) < 0.1
    found = answer(time, fast, np.where(straight, expected, np.nan), ROBOT)
    assert found is not None
    assert found.yaw is None
    assert misdescribed(found, ROBOT)[1].startswith("write robot.wheel_radius: 0.0463, as the")
    assert misdescribed(answer(time, 0.0 * fast, expected, ROBOT), ROBOT) == ("", "")  # an e-stop
    half = np.where(time[:, None] < 30.0, fast, expected)  # a fault that begins
    assert misdescribed(answer(time, half, expected, ROBOT), ROBOT) == ("", "")
    assert misdescribed(answer(time, -expected, expected, ROBOT), ROBOT) == ("", "")
    assert misdescribed(answer(time, fast[:, ::-1], expected, ROBOT), ROBOT) == ("", "")
    loop = evolve(ROBOT, controller=evolve(ROBOT.controller, integral=0.0))
    assert misdescribed(answer(time, fast, expected, loop), loop) == ("", "")


@pytest.mark.parametrize("twists", [[(0.3, 0.0, 0.0)], [(0.2, 0.0, 0.8)]])
def test_of_one_motion_three_values_explain_any_three_speeds(
    twists: list[tuple[float, float, float]],
) -> None:
    """A wheel that is dead looks like three wrong values, until the robot moves otherwise."""
    time = np.arange(0.0, 30.0, 0.05)
    straight = np.broadcast_to(np.array(twists[0]), (len(time), 3))
    expected = straight @ twist_to_wheels(ROBOT).T
    dead = expected * [0.95, 1.0, 1.0]
    found = answer(time, dead, expected, ROBOT)
    assert found is not None
    assert found.ways == 1
    assert misdescribed(found, ROBOT) == ("", "")
    found = answer(time, 1.05 * expected, expected, ROBOT)  # one value alone is believed
    assert misdescribed(found, ROBOT)[1].startswith("write robot.wheel_radius: 0.04762, as")
    # What a simulation wobbles by is no other motion.
    wobble = straight + 0.01 * np.sin(time)[:, None] * [1.0, 1.0, 0.0]
    expected = wobble @ twist_to_wheels(ROBOT).T
    assert misdescribed(answer(time, expected * [0.95, 1.0, 1.0], expected, ROBOT), ROBOT)[0] == ""
    both = np.where(time[:, None] < 15.0, straight, [[0.0, 0.3, 0.0]])
    expected = both @ twist_to_wheels(ROBOT).T
    assert answer(time, expected * [0.95, 1.0, 1.0], expected, ROBOT) is None
    assert answer(time, 1.05 * expected, expected, ROBOT) == Answer(
        pytest.approx(1.05), found.yaw and pytest.approx(1.05), pytest.approx(0.0), 2
    )


@pytest.mark.parametrize(
    "changes",
    [{"robot_radius": 0.4}, {"wheel_radius": 0.025}, {"wheel_offset": ROBOT.wheel_offset - 0.6}],
)
def test_gross_mistakes_are_left_to_others(changes: dict[str, float]) -> None:
    found = _answer(evolve(ROBOT, **changes))
    assert found is not None
    assert misdescribed(found, ROBOT) == ("", "")
