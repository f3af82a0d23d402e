"""Whether the robot is the one that is described, tick by tick."""

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from tomr_fault_diag.residuals.description import DescriptionWatch
from tomr_fault_diag.residuals.frame import Residual
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
DESCRIBED = twist_to_wheels(ROBOT)
# 3 s each: straight ahead, aside, turning on the spot, standing, and what is none of these.
LEGS = (
    (0.3, 0.0, 0.0),
    (0.0, -0.4, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, 0.0),
    (0.25, 0.1, -0.5),
    (-0.1, 0.3, 0.4),
    (-0.3, -0.2, 0.8),
)


def _take(
    watch: DescriptionWatch,
    seconds: float,
    matrix: np.ndarray,
    period: float = 0.05,
    powers: Callable[[np.ndarray], np.ndarray] = lambda powers: powers,
) -> None:
    """Wheels that turn by another matrix than the description's, and motors that draw by how fast
    they turn, in watt, with what sensors make of that."""
    for number in range(1, round(seconds / period) + 1):
        twist = LEGS[int(number * period // 3.0) % len(LEGS)]
        asked, turns = twist_to_wheels(ROBOT) @ twist, matrix @ twist
        signs = np.where(asked < 0.0, -1.0, 1.0)
        expected, drawn = 0.5 + np.abs(asked), powers(0.5 + np.abs(turns))
        watch.take(
            to_ns(number * period),
            [
                Residual(sign * (speed - model), 0.1, model, "rad/s")
                for sign, speed, model in zip(signs, turns, asked, strict=True)
            ],
            [
                Residual(power - model, 1.0, model)
                for power, model in zip(drawn, expected, strict=True)
            ],
        )


@pytest.mark.parametrize("period", [0.01, 0.05, 0.2])
def test_a_wrong_radius_is_said_once_it_is_sure_and_no_more_once_it_is_mended(
    period: float,
) -> None:
    watch = DescriptionWatch(ROBOT, to_ns(period))
    _take(watch, 4.0, 1.08 * DESCRIBED, period)
    assert watch.remark().level is Level.OK  # a fault may be all that is seen
    _take(watch, 48.0, 1.08 * DESCRIBED, period)
    remark = watch.remark()
    assert remark.level is Level.WARN
    assert remark.topic == "robot.yaml"
    assert "they turn 1.080 times as fast as described" in remark.message
    assert "write robot.wheel_radius: 0.0463" in remark.message  # 0.05 m / 1.08
    assert watch.words() == remark.message
    _take(watch, 250.0, DESCRIBED, period)  # two minutes of driving
    assert watch.remark().message == "nothing speaks against it"


def test_a_robot_that_stands_forgets_nothing() -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 48.0, 0.9 * DESCRIBED)
    said = watch.remark()
    still = [Residual(0.0, 0.1, 0.0, "rad/s")] * 3
    for number in range(6000):  # five minutes
        watch.take(to_ns(48.0 + 0.05 * number), still, still)
    assert said.level is Level.WARN
    assert watch.remark() == said


def test_what_is_not_known_says_nothing() -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    assert watch.words() == ""
    unknown = [Residual(math.nan, 0.1, 5.0, "rad/s")] * 3
    unpredicted = [Residual(math.nan, math.nan, math.nan, "rad/s")] * 3
    for number in range(1, 1000):
        watch.take(to_ns(0.05 * number), (unknown, unpredicted)[number % 2], unpredicted)
    assert watch.words() == ""
    assert watch.remark().level is Level.OK


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (
            DESCRIBED * [[1.0], [-1.0], [1.0]],
            "the encoder of wheel_2_joint counts against its sense",
        ),
        (DESCRIBED[[1, 2, 0]], "write robot.wheel_names: [wheel_3_joint, wheel_1_joint, "),
        (-DESCRIBED, "all wheels turn against their sense"),
        (2.0 * DESCRIBED, "the wheels turn 2 times as fast as described"),
        (DESCRIBED * [1.0, 1.0, -1.0], "angular.z of the commands has the wrong sign"),
    ],
)
def test_gross_mistakes_are_named(matrix: np.ndarray, words: str) -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 24.0, matrix)
    assert words in watch.words()
    assert watch.words().startswith("wheels and commands: ")


def _ramped(legs: np.ndarray, limit: float) -> np.ndarray:
    """Twists every 5 ms by a limit of the acceleration [m/s^2], as means of 0.05 s."""
    now, found = np.zeros(3), []
    for wanted in np.repeat(legs, 10, axis=0):
        step = wanted - now
        now = now + step * min(1.0, 0.005 * limit / max(float(np.linalg.norm(step)), 1e-9))
        found.append(now)
    return np.reshape(found, (-1, 10, 3)).mean(axis=1)


def test_a_ramp_that_is_not_described_is_named() -> None:
    """The reference robot's description has 2 m/s^2; this one's drivers keep to 0.5."""
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    legs = np.array([LEGS[number // 60 % 2] for number in range(960)])  # ahead and aside
    nothing = [Residual(math.nan, math.nan, math.nan, "rad/s")] * 3
    asked, turns = (_ramped(legs, limit) @ DESCRIBED.T for limit in (2.0, 0.5))
    for number, (models, speeds) in enumerate(zip(asked, turns, strict=True), start=1):
        residuals = [
            Residual(math.copysign(1.0, model) * (speed - model), 0.1, model, "rad/s")
            for model, speed in zip(models, speeds, strict=True)
        ]
        watch.take(to_ns(0.05 * number), residuals, nothing)
    remark = watch.remark()
    assert remark.level is Level.WARN
    assert "let the velocity change by about 0.5 m/s^2, 2 is described" in remark.message
    assert ": write controller.acceleration_limit: 0.5, or" in remark.message
    assert watch.mistake == remark.message


@pytest.mark.parametrize("matrix", [DESCRIBED, DESCRIBED * [[1.0], [0.0], [1.0]]])
def test_a_robot_as_described_and_one_with_a_dead_wheel_are_not_mistaken(
    matrix: np.ndarray,
) -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 24.0, matrix)
    assert watch.words() == ""


def test_powers_with_the_wrong_sign_or_name_are_named() -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 24.0, DESCRIBED, powers=lambda powers: powers * [1.0, -1.0, 1.0])
    assert watch.words().startswith("the power of wheel_2 has the wrong sign: mend it")
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 21.0, DESCRIBED, powers=lambda powers: -powers)  # 18 s of driving: a slope, maybe
    assert watch.words() == ""
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 24.0, DESCRIBED, powers=lambda powers: powers - 9.0)  # down a slope
    assert watch.words() == ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        watch = DescriptionWatch(ROBOT, to_ns(0.05))
        _take(watch, 42.0, DESCRIBED, powers=lambda powers: 0.0 * powers - 9.0)  # stuck
        assert watch.words() == ""
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 24.0, DESCRIBED, powers=lambda powers: powers[[1, 0, 2]])
    assert watch.words().startswith(
        "the power of wheel_1 is that of wheel_2_joint, the power of wheel_2 is that of "
        "wheel_1_joint: exchange"
    )


@pytest.mark.parametrize(
    ("matrix", "is_gross"),
    [
        (DESCRIBED * [[1.0], [-1.0], [1.0]], True),
        (9.549 * DESCRIBED, True),  # in revolutions per minute
        (0.5 * DESCRIBED, False),  # a speed limit between commands and drivers looks so
        (1.03 * DESCRIBED, False),
        (DESCRIBED, False),
    ],
)
def test_a_gross_mistake_counts_once_it_is_seen_twice(matrix: np.ndarray, is_gross: bool) -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, 17.0, matrix)  # looked at after 5, 10 and 15 s; ten of driving show it
    assert watch.mistake == ""
    assert (watch.remark().level is Level.WARN) == (matrix is not DESCRIBED)
    _take(watch, 42.0, matrix)
    assert bool(watch.mistake) == is_gross
    assert bool(watch.words()) == (matrix is not DESCRIBED)


@pytest.mark.parametrize("before", [8.0, 21.0, 42.0])
def test_a_robot_that_is_stopped_is_the_one_described(before: float) -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.05))
    _take(watch, before, DESCRIBED)
    for _ in range(8):
        _take(watch, 21.0, 0.0 * DESCRIBED)
        assert watch.words() == ""


def test_many_decisions_a_second_show_no_more_than_twenty() -> None:
    watch, sparse = (DescriptionWatch(ROBOT, to_ns(period)) for period in (0.01, 0.05))
    _take(watch, 42.0, 1.08 * DESCRIBED, 0.01)
    _take(sparse, 42.0, 1.08 * DESCRIBED, 0.05)
    assert watch.words() == sparse.words() != ""
    assert abs(len(watch._ticks) - len(sparse._ticks)) < 10


def test_what_is_long_past_is_forgotten() -> None:
    watch = DescriptionWatch(ROBOT, to_ns(0.2))
    _take(watch, 420.0, 1.08 * DESCRIBED, 0.2)
    assert watch.words() != ""
    _take(watch, 168.0, DESCRIBED, 0.2)  # two minutes of driving, and standing between
    assert watch.words() == ""
