"""What is made of a standstill at the start, and of wheels that stand on a robot that does not."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_odometry.creep import Creep
from tomr_odometry.hindsight import Inputs
from tomr_odometry.kernel import (
    ACCELEROMETER,
    AX,
    GYRO,
    RIM,
    SLOPE,
    VX,
    YAW,
    Noise,
    X,
)
from tomr_odometry.standstill import Felt
from tomr_odometry.start import REST, Beginning, is_incredible, rested, start

Array = NDArray[np.float64]
NOISE = Noise()
FELT = Felt(np.array([0.01, 0.1, -0.05]), 25, is_steady=True)


def misled() -> tuple[Array, Array]:
    """A state that took a slide for biases."""
    x, P = start(NOISE, Creep())
    x[[X, YAW, VX, AX, RIM, GYRO, ACCELEROMETER, SLOPE]] = (
        1.0, math.pi / 2, 0.1, 0.5, 2.0, 0.02, 0.3, 0.01,
    )  # fmt: skip
    P[ACCELEROMETER, VX] = P[VX, ACCELEROMETER] = 1e-3
    return x, P


def test_a_standstill_shows_the_biases_whatever_was_made_of_them_before() -> None:
    x, P = rested(*misled(), NOISE, FELT)
    assert x[[GYRO, ACCELEROMETER, ACCELEROMETER + 1]] == pytest.approx([0.01, 0.1, -0.05])
    assert x[[VX, AX, SLOPE]] == pytest.approx(0.0)
    assert x[[X, YAW, RIM]] == pytest.approx([1.0, math.pi / 2, 2.0])
    assert P[GYRO, GYRO] == pytest.approx(NOISE.gyro**2 / 25)
    off = NOISE.accelerometer**2 / 25 + NOISE.slope**2
    assert P[ACCELEROMETER, ACCELEROMETER] == pytest.approx(off)
    assert P[VX, VX] == pytest.approx(NOISE.start_twist**2)
    assert P[ACCELEROMETER, VX] == 0.0
    assert P[AX, AX] == pytest.approx(NOISE.accelerometer**2 / 25)
    np.linalg.cholesky(P + 1e-12 * np.eye(len(P)))


def test_what_a_slope_is_felt_as_no_bias_is() -> None:
    x, P = rested(*misled(), NOISE, FELT)
    c, s = math.cos(x[YAW]), math.sin(x[YAW])
    # The accelerometer feels its bias less the pull of the slope: that is known exactly.
    ahead = np.zeros(len(x))
    ahead[[ACCELEROMETER, SLOPE, SLOPE + 1]] = 1.0, -c, -s
    assert ahead @ P @ ahead == pytest.approx(NOISE.accelerometer**2 / 25)
    left = np.zeros(len(x))
    left[[ACCELEROMETER + 1, SLOPE, SLOPE + 1]] = 1.0, s, -c
    assert left @ P @ left == pytest.approx(NOISE.accelerometer**2 / 25)


def begun(
    force: list[float], *, rest: float = 1.0, is_carried: bool = False
) -> tuple[Beginning, Array, Array, Array]:
    """After steps in which this was felt ahead [m/s^2] while the wheels stood for so long."""
    beginning, mode = Beginning(Creep()), np.zeros(4)
    x, P = start(NOISE, Creep())
    x[VX] = 0.3
    for step, now in enumerate(force):
        felt = np.array([0.0, 0.0, 0.0, now, 0.0, 9.81])
        given = Inputs(0.01 * step, 0.01, NOISE, np.zeros(3), np.zeros((2, 3)), felt)
        x, P = beginning.step((x, P), mode, given, rest, is_carried)
    return beginning, x, P, mode


def test_a_robot_at_rest_knows_its_biases() -> None:
    beginning, x, _, mode = begun([0.1] * 40)
    assert beginning.has_stood
    assert x[ACCELEROMETER] == pytest.approx(0.1)
    assert x[VX] == 0.0
    assert not mode.any()


@pytest.mark.parametrize(
    ("rest", "is_carried", "seconds"), [(REST, False, 0.4), (1.0, True, 0.4), (1.0, False, 0.2)]
)
def test_it_takes_wheels_that_stand_for_long_enough_and_nobody_who_carries_it(
    rest: float, is_carried: bool, seconds: float
) -> None:
    beginning, x, _, _ = begun([0.1] * round(100 * seconds), rest=rest, is_carried=is_carried)
    assert not beginning.has_stood
    assert x[VX] == 0.3


def test_a_bias_that_no_imu_has_is_no_standstill() -> None:
    beginning, x, _, _ = begun([0.5] * 40)
    assert not beginning.has_stood
    assert not is_incredible(x, NOISE)


@pytest.mark.parametrize(("rest", "has_stood"), [(2.9, False), (3.1, True)])
def test_a_robot_that_feels_it_for_long_stands_on_a_slope(rest: float, has_stood: bool) -> None:
    beginning, x, _, _ = begun([0.5] * 40, rest=rest)
    assert beginning.has_stood == has_stood
    assert x[ACCELEROMETER] == pytest.approx(0.5 if has_stood else 0.0)


def test_a_robot_that_speeds_up_while_its_wheels_stand_slides() -> None:
    growing = [0.01 * step for step in range(60)]
    beginning, x, P, mode = begun(growing)
    assert not beginning.has_stood
    assert (mode == 1.0).all()
    assert x[ACCELEROMETER] == 0.0
    # The velocity may be wrong altogether, since the start.
    assert math.sqrt(P[VX, VX]) == pytest.approx(0.32, rel=0.01)
    assert math.sqrt(P[X, X]) == pytest.approx(0.32 * 0.44, rel=0.05)
    # It is doubted once: what is learnt since then stays.
    assert begun([*growing, 0.8])[2] == pytest.approx(P)


def test_it_stands_later_on() -> None:
    assert begun([*(0.01 * step for step in range(60)), *[0.1] * 40])[0].has_stood


def test_a_robot_that_begins_to_slide_before_its_wheels_turn_does_not_stand() -> None:
    still, slides = [0.1] * 60, [0.1 + 0.02 * step for step in range(40)]
    assert begun(still)[0].has_stood
    # A robot that sets off feels that before coarse encoders count.
    assert begun([*still, *slides[:20]])[0].has_stood
    beginning, x, _, mode = begun([*still, *slides])
    assert not beginning.has_stood
    assert (mode == 1.0).all()
    assert x[ACCELEROMETER] == 0.0


def test_the_beginning_is_over_once_the_wheels_turn() -> None:
    beginning, x, P, mode = begun([0.1] * 60)
    for step, rest in enumerate([0.0] + [1.0] * 60):
        felt = np.array([0.0, 0.0, 0.0, 0.05 * step, 0.0, 9.81])
        given = Inputs(0.6 + 0.01 * step, 0.01, NOISE, np.zeros(3), np.zeros((2, 3)), felt)
        assert beginning.step((x, P), mode, given, rest, False)[1] is P
    assert beginning.has_stood
    assert not mode.any()


def test_a_robot_that_stands_is_not_doubted() -> None:
    beginning, x, P, mode = begun([0.1] * 60)
    x[GYRO] = 0.1
    felt = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 9.81])
    given = Inputs(0.6, 0.01, NOISE, np.zeros(3), np.zeros((2, 3)), felt)
    assert beginning.step((x, P), mode, given, 1.0, False)[1] is P


def test_what_was_felt_before_somebody_carried_it_says_nothing() -> None:
    beginning, state, mode = Beginning(Creep()), start(NOISE, Creep()), np.zeros(4)
    felt = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 9.81])
    for step in range(44):
        given = Inputs(0.01 * step, 0.01, NOISE, np.zeros(3), np.zeros((2, 3)), felt)
        state = beginning.step(state, mode, given, 1.0, 18 <= step < 20)
    assert not beginning.has_stood
