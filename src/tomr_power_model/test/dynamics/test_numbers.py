"""Geometry and masses of vehicles on any wheels, worked by hand."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, record_length, timing_of
from tomr_power_model.dynamics.vehicle import Vehicle, omni_wheel
from tomr_power_model.robot import GRAVITY

MakeVehicle = Callable[..., Vehicle]

RADIUS, AXLE = 0.05, 6.0e-4 + 20.0**2 * 5.0e-6
ROOT = math.sqrt(0.5)


def records(vehicle: Vehicle) -> np.ndarray:
    p = laid_out(vehicle)
    first = at.HEADER + vehicle.count * record_length()
    return p[at.HEADER : first].reshape(vehicle.count, -1)


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        # omega = (sin vx - cos vy - R wz) / r of ros2_controllers, at 0, 120 and 240 degrees
        ("three_omni", [[0.0, -1.0, -0.2], [0.8660254, 0.5, -0.2], [-0.8660254, 0.5, -0.2]]),
        # wheels at 45, 135, .. degrees drive anti-clockwise
        (
            "four_omni",
            [[-ROOT, ROOT, 0.2], [-ROOT, -ROOT, 0.2], [ROOT, -ROOT, 0.2], [ROOT, ROOT, 0.2]],
        ),
        # omega = (vx -+ vy -+ (lx + ly) wz) / r: front left, rear left, rear right, front right
        (
            "four_mecanum",
            [[1.0, -1.0, -0.35], [1.0, 1.0, -0.35], [1.0, -1.0, 0.35], [1.0, 1.0, 0.35]],
        ),
        ("two_driven", [[1.0, 0.0, -0.15], [1.0, 0.0, 0.15]]),
    ],
)
def test_wheel_speeds_per_twist(
    make_vehicle: MakeVehicle, kind: str, rows: list[list[float]]
) -> None:
    found = records(make_vehicle(kind))
    np.testing.assert_allclose(found[:, at.ROLL : at.ROLL + 3], np.array(rows) / RADIUS, atol=1e-6)
    np.testing.assert_allclose(found[:, at.ASK : at.ASK + 3], np.array(rows) / RADIUS, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "along"),
    [
        ("four_omni", [[-ROOT, -ROOT, 0.0], [ROOT, -ROOT, 0.0], [ROOT, ROOT, 0.0]]),
        ("four_mecanum", [[ROOT, ROOT, ROOT * 0.05], [ROOT, -ROOT, ROOT * 0.05]]),
        ("two_driven", [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]),
    ],
)
def test_sliding_along_the_rollers_per_twist(
    make_vehicle: MakeVehicle, kind: str, along: list[list[float]]
) -> None:
    found = records(make_vehicle(kind))[: len(along), at.ALONG : at.ALONG + 3]
    np.testing.assert_allclose(found, along, atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "masses"),
    [
        # Each wheel adds J (d omega / d nu)^2.
        ("three_omni", [15.0 + 1.5 * AXLE / 0.0025] * 2 + [0.35 + 3 * AXLE * 0.04 / 0.0025]),
        ("four_omni", [15.0 + 2.0 * AXLE / 0.0025] * 2 + [0.35 + 4 * AXLE * 0.04 / 0.0025]),
        ("four_mecanum", [15.0 + 4.0 * AXLE / 0.0025] * 2 + [0.35 + 4 * AXLE * 0.1225 / 0.0025]),
        ("two_driven", [15.0 + 2.0 * AXLE / 0.0025, 15.0, 0.35 + 2 * AXLE * 0.0225 / 0.0025]),
    ],
)
def test_a_short_push_meets_body_and_wheels(
    make_vehicle: MakeVehicle, kind: str, masses: list[float]
) -> None:
    """The gain of a step tends to h over the mass where the motors hardly damp."""
    vehicle = make_vehicle(kind, physics={})
    weak = tuple(evolve(motor, resistance=1e9) for motor in vehicle.motors)
    p = laid_out(evolve(vehicle, motors=weak))
    gain = p[at.GAIN : at.GAIN + 9].reshape(3, 3)
    np.testing.assert_allclose(p[at.STEP] / np.diag(gain), masses, rtol=1e-6)
    np.testing.assert_allclose(gain - np.diag(np.diag(gain)), 0.0, atol=1e-12)


def test_wheels_and_casters_carry_the_robot(make_vehicle: MakeVehicle) -> None:
    weight = 15.0 * GRAVITY
    four = records(make_vehicle("four_omni", mass_center=(0.0, 0.0, 0.1)))[:, at.LOAD]
    np.testing.assert_allclose(four, weight / 4.0)
    # Two wheels and two casters, each a quarter; the mass centre ahead loads the front caster.
    two = records(make_vehicle("two_driven", mass_center=(0.1, 0.0, 0.1)))[:, at.LOAD]
    np.testing.assert_allclose(two, weight / 4.0)
    # Moments about y: 0.2 (N1 - (N2 + N3) / 2) = 0.03 m g.
    shifted = records(make_vehicle(mass_center=(0.03, 0.0, 0.12)))[:, at.LOAD]
    assert shifted.sum() == pytest.approx(weight)
    assert 0.2 * (shifted[0] - 0.5 * (shifted[1] + shifted[2])) == pytest.approx(0.03 * weight)


@pytest.mark.parametrize("kind", ["three_omni", "four_omni", "four_mecanum"])
def test_speeding_up_leans_on_the_wheels_behind(make_vehicle: MakeVehicle, kind: str) -> None:
    vehicle = make_vehicle(kind, mass_center=(0.0, 0.0, 0.2))
    found = records(vehicle)
    forward, left = found[:, at.LOAD_X], found[:, at.LOAD_Y]
    places = np.array([[wheel.x, wheel.y] for wheel in vehicle.wheels])
    np.testing.assert_allclose([forward.sum(), left.sum()], 0.0, atol=1e-12)
    np.testing.assert_allclose(forward @ places, [-15.0 * 0.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(left @ places, [0.0, -15.0 * 0.2], atol=1e-12)


def test_a_small_wheel_turns_faster_than_its_driver_believes(make_vehicle: MakeVehicle) -> None:
    found = records(make_vehicle(further={"kinematic.wheel_radius": {"scale": 0.96}}))
    np.testing.assert_allclose(
        0.96 * found[:, at.ROLL : at.ROLL + 3], found[:, at.ASK : at.ASK + 3]
    )


def test_periods_are_cut_into_steps_of_at_most_five_milliseconds() -> None:
    assert (timing_of(200.0).steps, timing_of(200.0).step) == (1, 0.005)
    assert (timing_of(30.0).steps, timing_of(30.0).continuous) == (7, False)
    assert (timing_of(1000.0).period, timing_of(1000.0).continuous) == (0.005, True)


def test_a_wheel_that_drives_along_its_rollers_is_refused(make_vehicle: MakeVehicle) -> None:
    omni = omni_wheel(0.2, 0.0, 0.0)
    wrong = type(omni)(0.2, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"\(0\.2, 0\) m drives along its rollers"):
        laid_out(make_vehicle(wheels=(omni, omni, wrong)))
