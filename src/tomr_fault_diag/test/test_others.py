"""Commands that are another's: wheels turn otherwise, and each motor draws what that takes."""

import numpy as np
import pytest

from tomr_fault_diag.classifier.misfit import MisfitWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.others import OthersWatch
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_power_model.robot import shipped_robot

TICK = 50_000_000
IDLE = Motors(shipped_robot("reference")).idle
BAND = 1.0  # W, of power beside the encoders'; a speed's is 0.2 rad/s
TOWED = IDLE + np.array([0.9, -0.9, 3.0])  # W
WORKING = IDLE + np.array([3.0, -2.0, 0.0])  # W
FAR = np.array([2.0, -2.0, 0.1])  # rad/s


Part = tuple[int, np.ndarray, np.ndarray, np.ndarray]


def frame(at: int, off: np.ndarray, drawn: np.ndarray, beside: np.ndarray) -> ResidualFrame:
    """A tick: speeds off [rad/s], power drawn [W], and what it is off that of the encoders [W]."""
    motors = [Residual(value, 2.0, 0.0) for value in drawn.tolist()]
    speeds = [Residual(value, 0.2, 0.0, "rad/s") for value in off.tolist()]
    derived = [Residual(value, BAND, 0.0) for value in beside.tolist()]
    return ResidualFrame(10**18 + at * TICK, (Residual(0.0, 2.0, 20.0), *motors, *speeds, *derived))


def found(*parts: Part) -> list[int]:
    """Ticks at which others are obeyed, of so many like each part."""
    watch, said = OthersWatch(), []
    for off, drawn, beside in (part[1:] for part in parts for _ in range(part[0])):
        derived = [Residual(value, BAND, 0.0) for value in beside.tolist()]
        now = 10**18 + len(said) * TICK
        said.append(watch.take(now, np.abs(off) > 0.6, drawn - IDLE, derived))
    return [at for at, is_said in enumerate(said) if is_said]


FITS = np.array([0.5, -0.5, 0.0])


def test_where_motors_draw_what_their_wheels_show_others_are_obeyed_after_a_second() -> None:
    assert found((25, FAR, WORKING, FITS)) == list(range(20, 25))


@pytest.mark.parametrize(
    ("off", "drawn", "beside"),
    [
        pytest.param([2.0, 0.5, 0.1], WORKING, FITS, id="one wheel alone"),
        pytest.param(FAR, TOWED, FITS, id="what a wheel is towed by"),
        pytest.param(FAR, WORKING, [0.5, 1.1, 0.0], id="a motor that draws otherwise"),
        pytest.param(FAR, WORKING, [0.5, np.nan, 0.0], id="one whose power is not known"),
        pytest.param([2.0, np.nan, 0.1], WORKING, FITS, id="a speed that is not known"),
    ],
)
def test_else_they_are_not(off: list[float], drawn: np.ndarray, beside: list[float]) -> None:
    assert found((40, np.array(off), np.asarray(drawn), np.array(beside))) == []


def test_a_motor_that_no_longer_draws_what_its_wheel_shows_has_a_fault_of_its_own() -> None:
    off = np.array([0.5, 1.1, 0.0])
    assert found((6, FAR, WORKING, FITS), (30, FAR, WORKING, off)) == []


def test_a_wheel_that_turns_as_asked_by_chance_is_no_end() -> None:
    """For 0.15 s."""
    far, one = (FAR, WORKING, FITS), (np.array([2.0, 0.0, 0.1]), WORKING, FITS)
    assert found((7, *far), (3, *one), (22, *far))[0] == 20
    assert found((7, *far), (4, *one), (22, *far))[0] == 31


def test_where_data_are_missing_nothing_is_concluded() -> None:
    """Of what was seen before neither: commands that are lost are no other's."""
    far, missing = (FAR, WORKING, FITS), (FAR, WORKING, FITS * np.nan)
    assert found((19, *far), (1, *missing), (20, *far)) == []
    assert found((19, *far), (1, FAR, WORKING * np.nan, FITS), (21, *far)) == [40]


def test_a_motor_that_worked_is_remembered_for_a_moment() -> None:
    """Its power passes that of an idle one where the wheel turns round: 0.7 s, and the pause."""
    assert found((16, FAR, WORKING, FITS), (30, FAR, IDLE, FITS)) == list(range(20, 33))


def test_one_that_worked_otherwise_than_its_wheel_shows_is_not() -> None:
    off = np.array([0.5, 1.1, 0.0])
    assert found((1, FAR, WORKING, off), (12, FAR, IDLE, FITS)) == []


def test_the_robot_is_said_not_to_follow() -> None:
    watch = MisfitWatch(IDLE.tolist())
    said = [watch.take(frame(at, FAR, WORKING, FITS), 0.5).obeys_others for at in range(22)]
    assert said == [False] * 20 + [True] * 2
    watch.clear()
    assert not watch.take(frame(22, FAR, WORKING, FITS), 0.5).obeys_others
