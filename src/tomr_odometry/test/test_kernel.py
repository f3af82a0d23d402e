"""The filter's Jacobians are those of its equations, and creep and slope have their signs."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_odometry.creep import Creep
from tomr_odometry.kernel import (
    AX,
    CREEP,
    DRAG,
    RIM,
    SIZE,
    SLOPE,
    VX,
    YAW,
    Noise,
    correct,
    force_rows,
    judge,
    motion_rows,
    predict,
)
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
BODY, NOISE = body_of(shipped_robot("reference"))[0], Noise()
MODE = np.array([0.0, 1.0, 0.3, 1.0])
USED, DT = np.array([0.02, -0.03, 0.05]), 0.01
RIMS = np.array([[0.1, 0.2, 0.3], [1e-6, 1e-6, 1e-6]])
FELT = np.array([0.0, 0.0, 0.3, 0.5, -0.2, 9.8])
FORCES = np.array([[0.0, 2.0, 1.0, 3.0], [2.0, -1.0, 1.0, -4.0]])


def state() -> Array:
    return np.random.default_rng(1).normal(0.0, 0.4, SIZE)


def derivative(of: Callable[[Array], Array]) -> Array:
    """Columns: change of a function's values with each state."""
    columns = []
    for k in range(SIZE):
        change = 1e-6 * np.eye(SIZE)[k]
        columns.append((of(state() + change) - of(state() - change)) / 2e-6)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(
    "rows",
    [
        lambda x: motion_rows(x, NOISE, RIMS, FELT)[:2],
        lambda x: force_rows(x, BODY, FORCES)[:2],
    ],
    ids=["encoders and IMU", "forces"],
)
def test_rows_are_what_innovations_change_by(rows: Callable[[Array], tuple[Array, Array]]) -> None:
    h = rows(state())[0]
    found = -derivative(lambda x: rows(x)[1])
    found[:, YAW] = h[:, YAW]  # a slope must not turn the heading
    if len(h) == len(FORCES):  # centrifugal and dry terms count little, and are left out
        found[:, VX : VX + 3] = h[:, VX : VX + 3]
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
        slides = mode[:3] * (NOISE.slide * DT) ** 2
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
    judge(np.zeros(SIZE), np.eye(SIZE), NOISE._replace(slip_rate=0.0), mode, RIMS, DT)
    assert mode.tolist() == [0.0, 0.0, 0.0, 0.5]


def test_one_measurement_weighs_by_what_was_known() -> None:
    # News of 1, variances of 3 and 1: three quarters of it are believed.
    h, x = np.eye(SIZE)[[DRAG]], np.zeros(SIZE)
    left = correct(x, 3.0 * np.eye(SIZE), h, np.ones(1), np.ones(1), NOISE.gate, False)
    assert x == pytest.approx(0.75 * np.eye(SIZE)[DRAG])
    assert left.diagonal() == pytest.approx(3.0 - 2.25 * np.eye(SIZE)[DRAG])


def test_a_robot_at_rest_on_a_slope_feels_it_as_a_pull_back() -> None:
    # Downhill is +x: the floor holds the robot back, and an accelerometer feels that.
    x, doubt = np.zeros(SIZE), np.diag(np.full(SIZE, 1e-12))
    doubt[SLOPE, SLOPE] = 1.0
    rows = motion_rows(x, NOISE, RIMS * 0.0 + [[0.0], [1e-6]], np.array([0, 0, 0, -0.3, 0.0, 9.8]))
    correct(x, doubt, *rows, NOISE.gate, False)
    assert x[SLOPE] == pytest.approx(0.3, abs=0.02)


def test_forces_that_accelerate_the_body_as_it_does_are_no_news() -> None:
    x, change = np.zeros(SIZE), np.array([0.7, -0.4, 1.1])
    x[AX : AX + 3] = change
    force = BODY.to_twist.T @ BODY.inertia @ change
    rows = np.stack([np.arange(3.0), force, np.ones(3), np.ones(3)], axis=1)
    assert force_rows(x, BODY, rows)[1] == pytest.approx(0.0, abs=1e-9)


def test_creep_grows_with_the_square_of_traction() -> None:
    creep = Creep((0.1, 0.2, 0.3), 4.0, 0.0)
    expected = np.array([0.5, 1.0, 1.5]) * 0.5 * (1.0 + 4.0 * 0.25)
    assert creep.shape(np.full(3, 0.5)) == pytest.approx(expected)
