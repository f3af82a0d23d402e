"""The filter's Jacobians are those of its equations, and creep and slope have their signs."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_odometry.creep import Creep
from tomr_odometry.kernel import (
    ACCELEROMETER,
    AX,
    CREEP,
    GYRO,
    RIM,
    SIZE,
    SLOPE,
    SURE,
    VX,
    YAW,
    Noise,
    correct,
    held_of,
    judge,
    motion_rows,
    predict,
    step,
)
from tomr_odometry.start import start
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
BODY, NOISE = body_of(shipped_robot("reference"))[0], Noise()
MODE = np.array([0.0, 1.0, 0.3, 1.0])
USED, DT = np.array([0.02, -0.03, 0.05]), 0.01
NONE = np.zeros(3, dtype=bool)
RIMS = np.array([[0.1, 0.2, 0.3], [1e-6, 1e-6, 1e-6]])
FELT = np.array([0.0, 0.0, 0.3, 0.5, -0.2, 9.8])


def state() -> Array:
    return np.random.default_rng(1).normal(0.0, 0.4, SIZE)


def derivative(of: Callable[[Array], Array]) -> Array:
    """Columns: change of a function's values with each state."""
    columns = []
    for k in range(SIZE):
        change = 1e-6 * np.eye(SIZE)[k]
        columns.append((of(state() + change) - of(state() - change)) / 2e-6)
    return np.stack(columns, axis=1)


def test_rows_are_what_innovations_change_by() -> None:
    h = motion_rows(state(), NOISE, RIMS, FELT)[0]
    found = -derivative(lambda x: motion_rows(x, NOISE, RIMS, FELT)[1])
    found[:, YAW] = h[:, YAW]  # a slope must not turn the heading
    assert h == pytest.approx(found, abs=1e-6)


def test_prediction_spreads_doubt_as_it_moves_the_state() -> None:
    def predicted(x: Array) -> Array:
        x = x.copy()
        predict(x, np.zeros((SIZE, SIZE)), BODY, NOISE, MODE, USED, DT)
        return x

    wanted = derivative(predicted)
    noise = predict(state(), np.zeros((SIZE, SIZE)), BODY, NOISE, MODE, USED, DT)
    for k in range(SIZE):
        doubt = np.outer(np.eye(SIZE)[k], np.eye(SIZE)[k])
        spread = predict(state(), doubt, BODY, NOISE, MODE, USED, DT) - noise
        assert spread == pytest.approx(np.outer(wanted[:, k], wanted[:, k]), abs=2e-4), k


def test_rims_are_loose_where_a_wheel_slid_a_moment_ago() -> None:
    x = np.zeros(SIZE)
    x[VX] = 0.5
    ground = BODY.rows @ (0.5, 0.0, 0.0)
    grip = NOISE.grip**2 + (NOISE.grip_share * ground) ** 2
    for recent, loose in ((0.0, 1.0), (0.5, 6.0)):  # 1 + doubt x recent
        mode = np.array([0.0, 0.2, 0.0, recent])
        spread = predict(x.copy(), np.zeros((SIZE, SIZE)), BODY, NOISE, mode, USED, DT).diagonal()
        rates = 0.5 * DT**2 * BODY.rows  # of the body's acceleration
        by_rates = rates**2 @ spread[AX : AX + 3]
        slides = mode[:3] * NOISE.slide**2 * NOISE.slide_time * DT
        wanted = grip * loose**2 * DT + slides + by_rates
        assert spread[RIM : RIM + 3] == pytest.approx(wanted, rel=1e-9)


def test_rims_that_creep_turn_faster_than_the_ground_goes() -> None:
    x = np.zeros(SIZE)
    x[VX], x[CREEP] = 0.5, 0.4
    predict(x, np.eye(SIZE), BODY, NOISE, np.zeros(4), USED, DT)
    ground = BODY.rows @ (0.5, 0.0, 0.0) * DT
    assert x[RIM : RIM + 3] - ground == pytest.approx(0.4 * USED * DT)


def test_wheels_are_taken_for_gripping_where_nothing_shows_a_slide() -> None:
    mode = np.array([0.9, 0.2, 1.0, 0.5])
    judge(np.zeros(SIZE), np.eye(SIZE), NOISE._replace(slip_rate=0.0), mode, RIMS, DT, NONE)
    assert mode.tolist() == [0.0, 0.0, 0.0, 0.5]


def test_a_wheel_known_to_slide_slides_whatever_its_rim_does() -> None:
    x, doubt, mode = np.zeros(SIZE), 1e-8 * np.eye(SIZE), np.full(4, 1e-6)
    still = np.array([[0.0] * 3, [1e-8] * 3])  # as the filter has it: nothing speaks for a slide
    judge(x, doubt, NOISE, mode, still, DT, np.array([False, True, False]))
    assert mode[1] == SURE
    assert mode[[0, 2]].max() < 1e-3
    loose = doubt.diagonal()[RIM : RIM + 3] - 1e-8
    assert loose == pytest.approx((mode[:3] - 1e-6) * NOISE.slide**2 * NOISE.slide_time * DT)


def test_contacts_that_chatter_slow_a_robot_down_by_what_is_felt_on_average() -> None:
    (x, P), mode = start(NOISE, Creep()), np.full(4, 1.0)
    x[VX] = 0.5
    slid, used, rims = np.ones(3, dtype=bool), np.zeros(3), np.zeros((2, 3))
    rims[1] = 1e-9
    for k in range(30):
        force = -2.0 + (4.5 if k % 2 else -4.5)
        felt = np.array([0.0, 0.0, 0.0, force, 0.0, 9.81])
        P = step(x, P, BODY, NOISE, mode, used, DT, rims, felt, slid)
    assert x[VX] == pytest.approx(0.5 - 0.3 * 2.0, abs=0.06)


@pytest.mark.parametrize(("since", "counted"), [(0.0, 1.0), (0.199, 1.0), (0.201, 1.0 / 3.0)])
def test_steps_that_speak_for_grip_soon_after_a_slide_are_one(since: float, counted: float) -> None:
    mode = np.array([0.5, 0.5, 0.5, since])
    loose = 0.5 * NOISE.slide**2 * NOISE.slide_time * DT
    doubt = (loose + 1e-8) * np.eye(SIZE)
    still = np.array([[0.0] * 3, [1e-8] * 3])
    judge(np.zeros(SIZE), doubt, NOISE, mode, still, DT, NONE)
    grips = 1e-8 + 2.0 * 1e-8  # m^2, with the encoders' twice over
    odds = math.sqrt(grips / (grips + (NOISE.slide * DT) ** 2)) ** counted
    prior = 0.5 * (1.0 - NOISE.grip_rate * DT) + 0.5 * NOISE.slip_rate * DT
    assert mode[:3] == pytest.approx(prior * odds / (prior * odds + 1.0 - prior))


def test_what_speaks_for_a_slide_counts_at_once() -> None:
    found = []
    for since in (0.0, 1.0):
        mode = np.array([1e-6, 1e-6, 1e-6, since])
        apart = np.array([[4e-3] * 3, [1e-8] * 3])
        judge(np.zeros(SIZE), 1e-7 * np.eye(SIZE), NOISE, mode, apart, DT, NONE)
        found.append(mode[:3].copy())
    assert found[0].min() > 0.9
    assert found[1] == pytest.approx(found[0])


@pytest.mark.parametrize(
    ("noise", "doubt", "kept"),
    [
        (NOISE, 0.1, slice(0, 0)),
        (NOISE, 0.3, slice(ACCELEROMETER, CREEP)),
        (NOISE._replace(slip_rate=0.0), 0.0, slice(ACCELEROMETER, SIZE)),
    ],
    ids=["gripping", "a slide a moment ago", "no IMU"],
)
def test_biases_are_learnt_while_wheels_grip(noise: Noise, doubt: float, kept: slice) -> None:
    held = held_of(noise, np.array([0.0, 0.0, 0.0, doubt]))
    before = np.eye(SIZE) + 0.5
    x, left = np.zeros(SIZE), before.copy()
    h = np.eye(SIZE)[[VX, GYRO]]
    left = correct(x, left, h, np.ones(2), np.ones(2), NOISE.gate, held)
    change = np.zeros(SIZE, dtype=bool)
    change[kept] = True
    assert np.all((x == 0.0) == change)
    assert left[kept, kept] == pytest.approx(before[kept, kept])
    assert left[VX, VX] < before[VX, VX]


def test_one_measurement_weighs_by_what_was_known() -> None:
    # News of 1, variances of 3 and 1: three quarters of it are believed.
    h, x = np.eye(SIZE)[[CREEP]], np.zeros(SIZE)
    left = correct(x, 3.0 * np.eye(SIZE), h, np.ones(1), np.ones(1), NOISE.gate, ACCELEROMETER)
    assert x == pytest.approx(0.75 * np.eye(SIZE)[CREEP])
    assert left.diagonal() == pytest.approx(3.0 - 2.25 * np.eye(SIZE)[CREEP])


def test_a_robot_at_rest_on_a_slope_feels_it_as_a_pull_back() -> None:
    # Downhill is +x: the floor holds the robot back, and an accelerometer feels that.
    x, doubt = np.zeros(SIZE), np.diag(np.full(SIZE, 1e-12))
    doubt[SLOPE, SLOPE] = 1.0
    rows = motion_rows(x, NOISE, RIMS * 0.0 + [[0.0], [1e-6]], np.array([0, 0, 0, -0.3, 0.0, 9.8]))
    correct(x, doubt, *rows, NOISE.gate, ACCELEROMETER)
    assert x[SLOPE] == pytest.approx(0.3, abs=0.02)


def test_creep_grows_with_the_square_of_traction() -> None:
    creep = Creep((0.1, 0.2, 0.3), 4.0, 0.0)
    expected = np.array([0.5, 1.0, 1.5]) * 0.5 * (1.0 + 4.0 * 0.25)
    assert creep.shape(np.full(3, 0.5)) == pytest.approx(expected)
