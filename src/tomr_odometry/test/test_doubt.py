"""How far the odometry trusts itself: ahead of its data, without an IMU, after leaps and starts."""

import numpy as np
import pytest
from odometry_drives import ROBOT, START

from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.hindsight import Inputs
from tomr_odometry.kernel import ACCELEROMETER, GYRO, RIM, VX

SECOND = 1_000_000_000


def standing(has_imu: bool, seconds: float = 1.0) -> SlipOdometry:
    core = SlipOdometry(ROBOT)
    for sample in range(round(100 * seconds)):
        stamp = START + 10_000_000 * sample
        core.encoders(stamp, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        if has_imu:
            core.imu(stamp, (0.0, 0.0, 0.0, 0.0, 0.0, 9.81))
        list(core.due())
    return core


def test_motion_goes_on_for_a_moment_and_then_anything_may_happen() -> None:
    core = standing(has_imu=True)
    core._x[VX], core._x[:3] = 0.4, 0.0
    soon, late = (core._estimate(core._time + round(SECOND * t)) for t in (0.1, 2.25))
    assert soon.pose[0] == pytest.approx(0.04, abs=1e-3)
    assert late.pose[0] == pytest.approx(0.1, abs=1e-3)
    for after, before in (
        (late.pose_covariance, soon.pose_covariance),
        (late.twist_covariance, soon.twist_covariance),
    ):
        assert np.diag(after - before) == pytest.approx(2.0**2, rel=0.01)


def test_a_change_of_speed_goes_on_for_less() -> None:
    core = standing(has_imu=True)
    core._x[VX : VX + 6] = 0.4, 0.0, 0.0, 1.0, 0.0, 0.0
    for ahead, speed in ((0.02, 0.42), (0.2, 0.45)):
        item = core._estimate(core._time + round(SECOND * ahead))
        assert item.twist[0] == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize(
    ("has_imu", "seconds", "is_sure"), [(True, 1.0, True), (True, 0.1, False), (False, 1.0, False)]
)
def test_an_imu_shows_its_biases_where_the_robot_stands(
    has_imu: bool, seconds: float, is_sure: bool
) -> None:
    core = standing(has_imu, seconds)
    assert core._beginning.has_stood == is_sure
    core._travel = np.array([1.0, 0.0])
    item = core._estimate(core._time)
    # Else wheels may slide unseen.
    assert (item.twist_covariance[0, 0] > 0.3) != is_sure


@pytest.mark.parametrize("rate", [10, 30])
def test_seldom_encoders_show_a_standstill_as_well(rate: int) -> None:
    core = SlipOdometry(ROBOT)
    for sample in range(100):
        stamp = START + 10_000_000 * sample
        core.imu(stamp, (0.0, 0.0, 0.01, 0.1, 0.0, 9.81))
        if sample % (100 // rate) == 0:
            core.encoders(stamp, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        list(core.due())
    assert core._beginning.has_stood
    assert core._x[ACCELEROMETER] == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize(("seconds", "spread"), [(3.0, 3.0), (-4.0, 4.0), (100.0, 10.0)])
def test_how_far_a_robot_came_in_a_leap_of_the_clock(seconds: float, spread: float) -> None:
    core = standing(has_imu=True)
    core._x[0] = 2.0
    core._start_afresh(core._time + round(SECOND * seconds))
    assert core._x[0] == 2.0
    assert np.sqrt(core._P[0, 0]) == pytest.approx(spread, rel=0.01)
    fresh = SlipOdometry(ROBOT)
    fresh._start_afresh(START)
    assert fresh._P[0, 0] < 1e-6


@pytest.mark.parametrize("has_stood", [False, True])
def test_biases_that_no_imu_has_are_a_start_that_misled(has_stood: bool) -> None:
    core = standing(has_imu=True, seconds=0.1)
    core._is_aided, core._beginning.has_stood, core._beginning._trusted = True, has_stood, 2.0
    core._x[0], core._x[VX], core._x[GYRO] = 3.0, 0.5, 0.1
    core._x[RIM : RIM + 3], core._P[1, 1] = 7.0, 100.0
    ways = np.stack([np.full(3, 7.0), np.full(3, 1e-6)])
    core._advance(START, 0.001, ways, np.full(6, np.nan))
    assert (core._x[GYRO] == 0.0) != has_stood
    assert (core._mode[:3] == 1.0).all() != has_stood
    assert core._x[0] == pytest.approx(3.0, abs=0.01)  # what is known of the way is kept
    assert core._x[RIM] == pytest.approx(7.0, abs=0.01)
    assert (np.sqrt(core._P[0, 0]) > 0.9) != has_stood  # 2 s at 0.5 m/s
    assert core._P[1, 1] > 99.0
    assert (np.sqrt(core._P[VX, VX]) > 0.4) != has_stood
    assert core._beginning._trusted == (2.0 if has_stood else 0.0)


def test_an_imu_alone_drifts_by_what_its_bias_is_off_by() -> None:
    core = standing(has_imu=True)
    aided, off, P = core._aided, 0.02, core._P
    for _ in range(400):
        P = aided._go_adrift(P, is_adrift=True, off=0.02, dt=0.01)
    assert aided.drift == pytest.approx(4.0 * off)
    assert np.sqrt(P[0, 0] - core._P[0, 0]) == pytest.approx(0.5 * off * 4.0**2, rel=0.01)
    assert np.sqrt(P[1, 1] - core._P[1, 1]) == pytest.approx(0.5 * off * 4.0**2, rel=0.01)
    item = core._estimate(core._time)
    assert np.sqrt(item.twist_covariance[1, 1]) == pytest.approx(4.0 * off, rel=0.05)
    assert np.sqrt(item.twist_covariance[2, 2]) < 0.05
    core._beginning.has_stood = False
    unsure = core._estimate(core._time)
    assert np.sqrt(unsure.twist_covariance[1, 1]) == pytest.approx(4.0 * off, rel=0.05)
    for _ in range(50):  # a moment of grip may be none
        P = aided._go_adrift(P, is_adrift=False, off=0.02, dt=0.01)
    assert aided.drift == pytest.approx(2.5 * off)
    for _ in range(100):
        P = aided._go_adrift(P, is_adrift=False, off=0.02, dt=0.01)
    assert aided.drift == 0.0
    assert aided._go_adrift(P, is_adrift=False, off=0.02, dt=0.01) is P
    again = aided._go_adrift(P, is_adrift=True, off=0.02, dt=0.01)
    assert again[0, 0] - P[0, 0] == pytest.approx((1e-4 * off) ** 2, rel=0.01)


@pytest.mark.parametrize("is_known", [True, False])
@pytest.mark.parametrize("is_sliding", [True, False])
def test_until_a_standstill_what_is_taken_for_a_bias_may_be_a_motion(
    is_known: bool, is_sliding: bool
) -> None:
    core = standing(has_imu=True)
    x, P, mode = core._x, core._P, np.full(4, float(is_sliding))
    x[ACCELEROMETER : ACCELEROMETER + 2] = 0.3, -0.4
    force = np.array([0.0, 0.0, 0.0, 0.3, -0.4, 9.81])
    ways = np.stack([x[RIM : RIM + 3], np.full(3, 1e-9)])
    noise = core.settings.noise
    given = Inputs(1e-9 * core._time, 0.01, noise, np.zeros(3), ways, force)
    core._aided._calm = -10.0  # it may be anything but a stand
    core._aided.step(x, P, mode, given, core._rims, is_known=is_known)
    off = np.sqrt(P[ACCELEROMETER, ACCELEROMETER])
    expected = 0.01 * (off if is_known else 0.5) if is_sliding or not is_known else 0.0
    assert core._aided.drift == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(("unknown", "drift"), [(4.98, 0.005), (4.995, 0.0)])
def test_that_is_doubted_for_so_long_only(unknown: float, drift: float) -> None:
    core = standing(has_imu=True)
    x, P, aided = core._x, core._P, core._aided
    x[ACCELEROMETER] = 0.5
    ways = np.stack([x[RIM : RIM + 3], np.full(3, 1e-9)])
    force = np.array([0.0, 0.0, 0.0, 0.5, 0.0, 9.81])
    given = Inputs(1e-9 * core._time, 0.01, core.settings.noise, np.zeros(3), ways, force)
    aided._unknown = unknown
    aided.step(x, P, np.zeros(4), given, core._rims, is_known=False)
    assert aided.drift == pytest.approx(drift, rel=0.05)
    aided.step(x, P, np.zeros(4), given, core._rims, is_known=True)
    assert aided._unknown == 0.0


def test_a_robot_that_stands_is_not_adrift() -> None:
    core = standing(has_imu=True)
    core._aided._adrift = 4.0
    core._aided._stand(core._x, core._P, core._mode)
    assert core._aided._adrift == 0.0


def test_an_imu_that_comes_back_looks_back_on_nothing() -> None:
    core = standing(has_imu=True)
    assert len(core._aided._hindsight._moments) > 30
    for sample in range(100, 140):
        core.encoders(START + 10_000_000 * sample, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        list(core.due())
    assert not core._is_aided
    assert not core._aided._hindsight._moments
