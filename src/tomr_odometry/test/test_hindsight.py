"""Wheels that slid unnoticed are found against the IMU, and their steps are taken back."""

import math

import numpy as np
import pytest
from attrs import frozen
from numpy.typing import NDArray

from tomr_odometry.aided import Aided
from tomr_odometry.creep import Creep
from tomr_odometry.hindsight import Hindsight, HindsightSettings, Inputs
from tomr_odometry.kernel import ACCELEROMETER, GYRO, SIZE, SURE, VX, VY, YAW, Noise
from tomr_odometry.rims import Rims
from tomr_odometry.start import start
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
BODY, RADIUS = body_of(shipped_robot("reference"))
NOISE, DT = Noise(), 0.01


@frozen
class Ride:
    """Samples of a body that speeds up along its x [m/s^2] while its rims do otherwise, and of
    wheels that stand after it."""

    body: float
    rims: float
    steps: int = 60
    biases: tuple[float, float] = (0.0, 0.0)  # of the accelerometer's x and the gyro


def known() -> tuple[Array, Array, Array]:
    """A filter that stands and knows its biases; state, covariance, modes."""
    x, P = start(NOISE, Creep())
    P[VX : VX + 3, VX : VX + 3] = 1e-6 * np.eye(3)
    P[ACCELEROMETER : GYRO + 1, ACCELEROMETER : GYRO + 1] = np.diag([1e-5, 1e-5, 1e-7])
    return x, P, np.array([1e-6, 1e-6, 1e-6, 0.0])


def given(step: int, ride: Ride, rims: Rims) -> Inputs:
    """What a step is given; the rims go on."""
    time, until = DT * step, DT * min(step, ride.steps)
    angle = 0.5 * ride.rims * until**2 * BODY.rows[:, 0] / RADIUS
    ways = rims.take(round(1e9 * time), np.floor(angle / 1e-4) * 1e-4, 1e-4)
    force = (ride.body if step <= ride.steps else 0.0) + ride.biases[0]
    felt = np.array([0.0, 0.0, ride.biases[1], force, 0.0, 9.81])
    return Inputs(time, DT, NOISE, np.zeros(3), ways, felt)


def looked_at(
    ride: Ride, settings: HindsightSettings | None = None, unknown: float | None = None
) -> list[Array]:
    """Which wheels slid, by a filter that has the body's velocity and the IMU's biases; or does not
    know that of the accelerometer, to so many m/s^2."""
    x, P, mode = known()
    x[ACCELEROMETER], x[GYRO] = ride.biases
    if unknown is not None:
        x[ACCELEROMETER], P[ACCELEROMETER, ACCELEROMETER] = 0.0, unknown**2
    rims, hindsight, found = Rims(RADIUS), Hindsight(BODY, settings), []
    for step in range(1, ride.steps + 1):
        inputs = given(step, ride, rims)
        x[VX] = ride.body * DT * (step - 1)
        hindsight.take(x, P, mode, inputs)
        found.append(hindsight.slid(rims).copy())
    return found


def test_wheels_that_turn_with_the_ground_slid_at_no_time() -> None:
    assert not np.any(looked_at(Ride(body=1.0, rims=1.0)))
    assert not np.any(looked_at(Ride(body=1.0, rims=1.0, biases=(0.15, 0.01))))
    # A step of this is 3 cm/s: what is compared is of the same moments.
    closely = HindsightSettings(apart=2.0)
    assert not np.any(looked_at(Ride(body=3.0, rims=3.0), closely))
    assert not np.any(looked_at(Ride(body=1.0, rims=1.0, biases=(0.15, 0.3)), closely))


def test_what_a_bias_that_is_not_known_may_have_done_is_no_slide() -> None:
    ride = Ride(body=1.0, rims=1.0, biases=(0.3, 0.0))  # a tenth of a metre per second in a third
    assert np.any(looked_at(ride, unknown=1e-3))
    assert not np.any(looked_at(ride, unknown=0.15))


def test_wheels_that_speed_up_without_the_body_are_found_within_moments() -> None:
    moving = np.abs(BODY.rows[:, 0]) > 0.1
    found = looked_at(Ride(body=0.0, rims=1.0))
    first = next(k for k, slid in enumerate(found) if slid.any())
    assert DT * first < 0.45
    assert found[-1][moving].all() or found[-2][moving].all()
    assert not np.any([slid[~moving] for slid in found])  # the wheel across does not turn


def test_nothing_is_said_before_there_is_enough_to_look_back_on() -> None:
    early = looked_at(Ride(body=0.0, rims=3.0, steps=27))
    assert not np.any(early)
    short = HindsightSettings(back=0.1)
    assert np.any(looked_at(Ride(body=0.0, rims=3.0, steps=27), short))


def test_a_turn_of_the_body_is_followed() -> None:
    """A velocity that stays in the odometry frame goes round in the robot's."""
    x, P, mode = known()
    rims, hindsight, rate, way = Rims(RADIUS), Hindsight(BODY), 2.0, np.zeros(3)
    for step in range(1, 60):
        yaw = rate * DT * step
        twist = np.array([0.5 * math.cos(yaw), -0.5 * math.sin(yaw), rate])
        way = way + DT * (BODY.rows @ twist)
        ways = rims.take(round(1e9 * DT * step), way / RADIUS, 1e-4)
        x[VX], x[VY], x[YAW] = twist[0], twist[1], yaw
        felt = np.array([0.0, 0.0, rate, 0.0, 0.0, 9.81])  # no force: it coasts on ice and turns
        hindsight.take(x, P, mode, Inputs(DT * step, DT, NOISE, np.zeros(3), ways, felt))
        assert not hindsight.slid(rims).any()


@pytest.mark.parametrize(("silent", "is_used"), [(4, True), (12, False)])
def test_an_imu_that_is_slower_than_the_encoders_is_used_and_one_that_dies_is_not(
    silent: int, is_used: bool
) -> None:
    x, P, mode = known()
    rims, hindsight, ride, found = Rims(RADIUS), Hindsight(BODY), Ride(body=0.0, rims=1.0), False
    for step in range(1, 80):
        inputs = given(step, ride, rims)
        if step % silent:
            inputs = inputs._replace(inertial=np.full(6, np.nan))
        hindsight.take(x, P, mode, inputs)
        found |= bool(hindsight.slid(rims).any())
    assert found == is_used


def test_the_steps_are_gone_through_again_with_a_wheel_that_slides() -> None:
    """Ice under all wheels: a filter that followed them has its velocity back."""
    x, P, mode = known()
    rims, hindsight, ride = Rims(RADIUS), Hindsight(BODY), Ride(body=0.0, rims=1.0)
    for step in range(1, 40):
        inputs = given(step, ride, rims)
        hindsight.take(x, P, mode, inputs)
        x[VX] = 0.01 * step  # misled
    again, _, modes = hindsight.again(np.array([True, True, True]))
    assert modes[:3].tolist() == [SURE] * 3
    assert abs(again[VX]) < 0.06 < x[VX]


def played(ride: Ride) -> tuple[Array, Array, Array]:
    """The filter itself on a ride."""
    x, P, mode = known()
    rims, aided = Rims(RADIUS), Aided(BODY)
    for step in range(1, ride.steps + 1):
        P = aided.step(x, P, mode, given(step, ride, rims), rims, is_known=True)
    return x, P, mode


@pytest.mark.parametrize("pull", [0.5, 1.0, 2.0])
def test_a_robot_whose_wheels_spin_from_rest_stays_where_it_is(pull: float) -> None:
    x, _, mode = played(Ride(body=0.0, rims=pull, steps=80))
    assert abs(x[0]) < 0.02  # the wheels say 0.16 to 0.64 m
    assert abs(x[VX]) < 0.03
    assert mode[:3].max() > 0.9


def test_a_robot_that_grips_goes_as_its_wheels_do() -> None:
    x, P, mode = played(Ride(body=1.0, rims=1.0, steps=80))
    assert x[0] == pytest.approx(0.5 * 0.8**2, abs=2e-3)
    assert mode[:3].max() < 0.1
    assert math.sqrt(P[0, 0]) < 0.01


@pytest.mark.parametrize(("steps", "stands"), [(28, False), (45, True)])
def test_a_robot_whose_wheels_rest_and_that_nothing_brakes_stands(steps: int, stands: bool) -> None:
    x, P, mode = known()
    rims, aided = Rims(RADIUS), Aided(BODY)
    x[VX], x[VY], mode[:3], aided._lost = 0.6, 0.3, SURE, 2.0  # an IMU that drifted, say
    ride = Ride(body=0.0, rims=0.0, biases=(0.3, 0.05))  # these it knows
    x[ACCELEROMETER], x[GYRO] = ride.biases
    for step in range(1, steps + 1):
        inputs = given(step, ride, rims)
        P = aided.step(x, P, mode, inputs, rims, is_known=True)
    assert (math.hypot(x[VX], x[VY]) < 0.02) == stands
    assert (mode[:3].max() < 0.01) == stands
    # What was two seconds of 0.7 m/s was none.
    assert (math.sqrt(P[0, 0]) > 1.0) == stands


def test_a_body_that_still_brakes_does_not_stand() -> None:
    x, P, mode = known()
    rims, aided = Rims(RADIUS), Aided(BODY)
    x[VX], P[VX, VX], mode[:3] = 0.8, NOISE.start_twist**2, SURE
    for step in range(1, 80):
        inputs = given(step, Ride(body=-0.3, rims=0.0), rims)
        P = aided.step(x, P, mode, inputs, rims, is_known=True)
    assert x[VX] == pytest.approx(0.8 - 0.3 * 0.79, abs=0.05)
    assert len(x) == SIZE
