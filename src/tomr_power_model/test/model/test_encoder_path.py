"""The encoder path: what the difference of two motions makes, on top of the simulated power."""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.model.commanded import Commanded, CommandPath, CommandTiming, Seen
from tomr_power_model.model.encoder_path import (
    EncoderPath,
    Rests,
    Simulated,
    alike,
    at_rest,
    beside,
)
from tomr_power_model.model.means import Means
from tomr_power_model.model.power_models import MeasuredMotion, Physical, Windows
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN3 = (math.nan, math.nan, math.nan)
STILL = Seen((0.0, 0.0, 0.0), NAN3, math.nan)
ROBOT = shipped_robot("reference")
Twist = tuple[float, float, float]
STOP, AHEAD, TURN = (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, 1.0)
DRAG = {"contact.roller_drag": ({"coefficient": 0.05, "slip": 0.0},) * 3}
MONITORS = {
    "sensor.power_scale": ({"scale": 1.1},) * 3,
    "sensor.power_lag": ({"time_constant": 0.1},) * 3,
}


def _robot(
    physics: Mapping[str, tuple[Mapping[str, float], ...]], name: str = "reference"
) -> Robot:
    robot = shipped_robot(name)
    return evolve(robot, physics={**robot.physics, **physics})


def _angles(robot: Robot, twists: list[tuple[int, Twist]], until_ms: int) -> dict[int, list[float]]:
    """Angles of wheels that do as they are commanded, by the time of the encoders' samples [ms]."""
    path = CommandPath(robot, CommandTiming(50 * MS))
    found: dict[int, list[float]] = {}
    for start_ms in range(0, until_ms, 50):
        newest = [twist for begin, twist in twists if begin <= start_ms][-1]
        path.command(BASE + start_ms * MS, newest)
        end = BASE + (start_ms + 50) * MS
        path.over(end, STILL)
        times = range(start_ms + 3, start_ms + 50, 10)
        if path.state is None:  # the first command is on its way
            found |= {t: [0.0, 0.0, 0.0] for t in times}
            continue
        seen, *_ = path.motion.beside([BASE + t * MS for t in times], end, 50 * MS)
        found |= dict(zip(times, seen.tolist(), strict=True))
    return found


def _predictions(
    robot: Robot,
    twists: list[tuple[int, Twist]],
    until_ms: int,
    *,
    faster: float = 0.0,
    yaw_rate: float | None = None,
) -> list[Prediction]:
    """Of a robot that does as it is commanded.

    Or whose wheels turn faster backwards [rad/s], or which has a gyro that says so much [rad/s].
    """
    predictor = PowerPredictor(robot, ModelSettings(use_imu=yaw_rate is not None))
    angles, found = _angles(robot, twists, until_ms), []
    for at_ms in range(until_ms):
        stamp = BASE + at_ms * MS
        if at_ms % 50 == 0:
            predictor.command(stamp, [twist for begin, twist in twists if begin <= at_ms][-1])
        if at_ms in angles:
            first, second, third = (angle - 1e-3 * faster * at_ms for angle in angles[at_ms])
            predictor.encoders(stamp, (first, second, third), NAN3)
            if yaw_rate is not None:
                predictor.imu(stamp, yaw_rate)
        found += predictor.due()
    return found


def _powers(prediction: Prediction) -> tuple[list[float], list[float]]:
    return [item.power for item in prediction.motors], [
        item.power for item in prediction.from_encoders
    ]


def test_the_difference_of_two_motions_by_hand() -> None:
    simulated, inverse, of_simulated = np.array([5.0] * 5), np.array([4.0] * 5), np.array([3.0] * 5)
    here = np.array([False, False, True, True, True])
    there = np.array([False, True, False, True, True])
    held = np.array([False, False, False, False, True])
    found = beside(simulated, inverse, of_simulated, Rests(here, there, held))
    # 5 + 4 - 3; at rest in the simulation alone inverse dynamics; where neither moves and no driver
    # is obeyed as simulated.
    assert found.tolist() == [6.0, 4.0, 6.0, 5.0, 6.0]
    # What both rest differ by is no motion.
    both = alike(np.full(5, 0.02), np.full(5, 0.07), (here, there))
    assert both.tolist() == [0.07, 0.07, 0.07, 0.02, 0.02]


def test_a_wheel_of_unknown_speed_does_not_rest() -> None:
    assert at_rest(np.array([0.09, -0.09, 0.11, math.nan])).tolist() == [True, True, False, False]


@pytest.mark.parametrize(
    "robot",
    [
        ROBOT,
        _robot(DRAG),
        _robot(MONITORS),
        _robot(MONITORS, "robotino_v2"),
        _robot({"sensor.encoder_scale": ({"scale": 1.1},) * 3}),
    ],
    ids=["reference", "rollers that drag", "monitors", "currents", "encoders"],
)
def test_of_wheels_that_turn_as_simulated_both_paths_say_the_same(robot: Robot) -> None:
    found = _predictions(robot, [(0, STOP), (500, AHEAD), (1500, TURN), (2500, STOP)], 3500)
    for prediction in found:
        commanded, measured = _powers(prediction)
        assert measured == pytest.approx(commanded, rel=1e-5, abs=1e-5, nan_ok=True)
        for one, other in zip(prediction.motors, prediction.from_encoders, strict=True):
            assert one.current == pytest.approx(other.current, rel=1e-5, abs=1e-5, nan_ok=True)


def test_faster_wheels_draw_more_by_what_their_speed_makes() -> None:
    """Friction 0.06 + 0.004 w N m, k 0.7 N m/A, 0.8 ohm: 0.3134 W at 4 rad/s, 0.3609 at 4.5."""
    plain = _predictions(ROBOT, [(0, STOP), (500, TURN)], 2500)[-1]
    faster = _predictions(ROBOT, [(0, STOP), (500, TURN)], 2500, faster=0.5)[-1]
    assert _powers(faster)[0] == pytest.approx(_powers(plain)[0], rel=1e-5)
    more = np.array(_powers(faster)[1]) - _powers(plain)[1]
    np.testing.assert_allclose(more, 0.3609 - 0.3134, atol=1e-4)


def test_a_driver_that_says_its_voltage_is_believed_of_a_wheel_that_rests() -> None:
    """0.5 V at 0.8 ohm and 1.2 W of standby, while the simulated drivers hold nothing."""
    held = {"friction.coulomb": ({"torque": 0.7},) * 3}  # N m: what a motor makes of 0.8 V
    predictor, last = PowerPredictor(_robot(held)), None
    for at_ms in range(3, 1000, 10):
        stamp = BASE + at_ms * MS
        predictor.command(stamp, STOP)
        predictor.encoders(stamp, STOP, NAN3)
        predictor.voltages(stamp, (0.5, math.nan, math.nan))
        last = next(iter(predictor.due()), last)
    assert last is not None
    assert _powers(last)[1] == pytest.approx([0.5**2 / 0.8 + 1.2, 1.2, 1.2], abs=1e-4)


def _of_resting(here: MeasuredMotion, there: MeasuredMotion) -> float:
    """Power of wheels that friction of 0.7 N m holds, 0.8 V at 0.8 ohm; 5 W are simulated."""
    robot = _robot({"friction.coulomb": ({"torque": 0.7},) * 3})
    path = EncoderPath(robot, Physical(robot, 0.05, False), 0.05, is_shown=False)
    whole = Means([5.0] * 3, [5.0] * 3, [5.0] * 3, [5.0] * 3)
    return path.means(here, Simulated(there, whole)).power[0]


def _resting(held: float, speed: float = 0.0, change: float = 0.0) -> MeasuredMotion:
    none, speeds, changes = [0.0] * 3, [speed] * 3, [change] * 3
    return MeasuredMotion(speeds, changes, none, math.nan, 0.0, none, [held] * 3)


@pytest.mark.parametrize(
    ("volts", "expected", "difference"),
    [
        (0.5, 0.2, (0.5**2 - 0.2**2) / 0.8),
        (1.2, 0.2, 0.0),  # it would turn, so no driver holds that
        (0.5, -1.2, 0.0),
    ],
)
def test_of_a_wheel_that_rests_the_drivers_voltages_make_the_difference(
    volts: float, expected: float, difference: float
) -> None:
    found = _of_resting(_resting(volts), _resting(expected))
    assert found == pytest.approx(5.0 + difference)


@pytest.mark.parametrize(("speed", "change"), [(0.08, 0.0), (0.05, 1.0)])
def test_how_a_wheel_comes_to_rest_makes_none(speed: float, change: float) -> None:
    assert _of_resting(_resting(0.3, 0.05), _resting(0.3, speed, change)) == pytest.approx(5.0)


def test_what_a_gyro_says_of_the_body_is_no_motion_of_the_simulated_one() -> None:
    """It turns faster than its wheels say: on a curve that takes more force."""
    curve = [(0, STOP), (500, (0.3, 0.0, 1.0))]
    as_wheels, faster = (
        _powers(_predictions(ROBOT, curve, 2500, yaw_rate=yaw_rate)[-1]) for yaw_rate in (1.0, 1.3)
    )
    assert as_wheels[1] == pytest.approx(as_wheels[0], rel=1e-4)
    assert np.abs(np.array(faster[1]) - as_wheels[1]).max() > 0.05  # W


def test_what_rollers_hold_that_do_not_turn_is_known_of_the_encoders_as_well() -> None:
    """On the spot no roller turns: how they came to rest says what they hold, not the motion."""
    robot, turned = _robot(DRAG), []
    for twist in (AHEAD, (-0.3, 0.0, 0.0)):
        found = _predictions(robot, [(0, STOP), (500, twist), (2000, TURN)], 4000)[-1]
        turned.append(_powers(found)[1])
    ahead, back = turned
    assert np.abs(np.array(ahead) - back).max() > 0.1  # W


class _Drawn:
    """A power model that says of a motion what its first wheel's speed is [W]."""

    def commanded(self, motion: Commanded, windows: Windows) -> Means:
        raise NotImplementedError

    def measured(self, motion: MeasuredMotion) -> Means:
        power = [motion.speed[0]] * 3
        return Means(power, power, power, power)

    def clear(self) -> None:
        """It remembers nothing."""


def test_monitors_lag_alike_in_both_motions_also_after_a_time_without_simulation() -> None:
    def moving(speed: float) -> MeasuredMotion:
        nothing = [0.0] * 3
        return MeasuredMotion([speed] * 3, nothing, nothing, math.nan, 0.0, nothing, nothing)

    path = EncoderPath(_robot(MONITORS), _Drawn(), 0.05, is_shown=False)
    path.means(moving(2.0), None)
    whole = Means([5.0] * 3, [5.0] * 3, [5.0] * 3, [5.0] * 3)
    found = path.means(moving(4.0), Simulated(moving(4.0), whole))
    assert found.power == pytest.approx([5.0] * 3)


def test_a_model_that_knows_no_voltages_says_nothing_of_wheels_that_rest() -> None:
    def moving(speed: float) -> MeasuredMotion:
        nothing = [0.0] * 3
        return MeasuredMotion([speed, 0.0, 0.0], nothing, nothing, math.nan, 0.0, nothing, nothing)

    path = EncoderPath(ROBOT, _Drawn(), 0.05, is_shown=True)
    whole = Means([5.0] * 3, [5.0] * 3, [5.0] * 3, [5.0] * 3)
    found = path.means(moving(2.0), Simulated(moving(3.0), whole))
    assert found.power == pytest.approx([5.0 + 2.0 - 3.0, 5.0, 5.0])
