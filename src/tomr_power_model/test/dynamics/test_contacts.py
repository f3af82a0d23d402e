"""Limited friction at the contacts of vehicles on any wheels: slip, grip, load transfer, slopes."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.vehicle import Vehicle
from tomr_power_model.robot import GRAVITY

MakeVehicle = Callable[..., Vehicle]
DriveVehicle = Callable[..., Any]

NO_LOOP = {"proportional": 0.0, "integral": 0.0}
REST = np.zeros((400, 3))
KINDS = ("three_omni", "four_omni", "four_mecanum", "two_driven")


def towards(twist: tuple[float, float, float], periods: int) -> np.ndarray:
    return np.tile(twist, (periods, 1))


@pytest.mark.parametrize(
    ("kind", "grip"),
    [
        # Traction of the gripping wheels along x over the weight, all wheels at their limit:
        ("three_omni", 2.0 * math.sqrt(0.75) / 3.0),
        ("four_omni", math.sqrt(0.5)),
        ("four_mecanum", math.sqrt(0.5)),  # rollers transmit across themselves only
        ("two_driven", 0.5),  # casters carry the other half
    ],
)
def test_wheels_that_spin_push_with_friction_times_load(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str, grip: float
) -> None:
    slippery = {"contact.slip": {"friction": 0.1}}
    vehicle = make_vehicle(kind, physics=slippery, mass_center=(0.0,) * 3, acceleration_limit=0.0)
    driven = drive_vehicle(vehicle, towards((50.0, 0.0, 0.0), 40))
    change = driven.twist[20:, 0] - driven.twist[19:-1, 0]
    np.testing.assert_allclose(change / 0.005, 0.1 * grip * GRAVITY, rtol=1e-6)
    np.testing.assert_allclose(driven.twist[:, 1:], 0.0, atol=1e-9)
    assert np.abs(driven.steps.gap[20:]).max() > 0.5


def test_tyres_that_spin_and_skid_brake_sideways(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    """Half of the weight is on them: 0.1 g / 2 along the spin and 0.1 g / 2 against the skid."""
    slippery = {"contact.slip": {"friction": 0.1}}
    vehicle = make_vehicle(
        "two_driven", physics=slippery, mass_center=(0.0,) * 3, acceleration_limit=0.0
    )
    state = Simulation(vehicle).start((0.0, 0.5, 0.0))
    driven = drive_vehicle(vehicle, towards((50.0, 0.0, 0.0), 40), state)
    change = driven.twist[39, :2] - driven.twist[19, :2]
    np.testing.assert_allclose(change / 0.1, [0.05 * GRAVITY, -0.05 * GRAVITY], rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_wheels_that_slid_roll_again(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    slippery = {"contact.slip": {"friction": 0.15}}
    rolls, slips = (
        drive_vehicle(
            make_vehicle(kind, further=further, acceleration_limit=0.0),
            towards((0.5, 0.0, 0.3), 600),
        )
        for further in ({}, slippery)
    )
    assert np.abs(slips.steps.gap).max() > 0.02
    assert np.abs(slips.steps.gap[-1]).max() < 1e-9
    np.testing.assert_allclose(slips.twist[-1], rolls.twist[-1], atol=1e-3)
    if len(slips.steps.power[-1]) < 4:  # four may go on working against each other
        np.testing.assert_allclose(slips.steps.power[-1], rolls.steps.power[-1], atol=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_a_grip_that_is_never_needed_changes_nothing(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    drive = np.concatenate([towards((0.3, 0.0, 0.5), 100), towards((0.0, 0.0, 0.0), 100)])
    plain, gripping = (
        drive_vehicle(make_vehicle(kind, further=further, mass_center=(0.0, 0.0, 0.0)), drive)
        for further in ({}, {"contact.slip": {"friction": 50.0}})
    )
    np.testing.assert_allclose(gripping.steps.power, plain.steps.power, atol=1e-6)


def test_tyres_hold_sideways_on_a_slope_until_grip_is_exceeded(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    # Two driven wheels carry half the weight: they hold up to sin(angle) = friction / 2.
    def across(sine: float) -> np.ndarray:
        slope = {"angle": math.asin(sine), "azimuth": 0.5 * math.pi}
        physics = {"contact.slip": {"friction": 0.2}, "body.slope": slope}
        vehicle = make_vehicle("two_driven", physics=physics, mass_center=(0.0,) * 3, **NO_LOOP)
        return np.asarray(drive_vehicle(vehicle, REST).twist)

    held = across(0.097)
    assert np.abs(held).max() < 1e-6
    # Beyond, the tyres drag with what they have.
    slid = across(0.15)
    speeding = (slid[-1, 1] - slid[199, 1]) / 1.0
    assert speeding == pytest.approx(0.05 * GRAVITY, rel=1e-3)
    assert np.abs(slid[:, 0]).max() < 1e-9


def test_a_robot_on_tyres_does_not_drift_sideways_in_a_curve(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    curve = drive_vehicle(make_vehicle("two_driven"), towards((0.5, 0.0, 1.0), 400))
    np.testing.assert_allclose(curve.twist[-1], [0.5, 0.0, 1.0], atol=2e-3)
    assert np.abs(curve.twist[:, 1]).max() < 1e-3


@pytest.mark.parametrize("kind", ["three_omni", "four_omni", "four_mecanum"])
def test_rollers_hold_a_robot_that_can_roll_any_way(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    """Rollers that drag resist a slope that friction at the axles does not."""
    slope = {"angle": 0.02, "azimuth": 0.7}
    physics = {"friction.coulomb": {"torque": 0.001}, "body.slope": slope}
    drags = {**physics, "contact.roller_drag": {"coefficient": 0.1, "slip": 0.0}}
    rolls, sticks = (
        drive_vehicle(make_vehicle(kind, physics=given, **NO_LOOP), REST).twist[-1]
        for given in (physics, drags)
    )
    assert np.hypot(*rolls[:2]) > 2e-3
    assert np.abs(sticks).max() < 1e-9


@pytest.mark.parametrize("kind", ["three_omni", "four_omni"])
def test_drag_of_rollers_by_hand(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    """In a straight drive the wheels slide along their axles: power = force times sliding."""
    drag = {"contact.roller_drag": {"coefficient": 0.1, "slip": 0.0}}
    vehicle = make_vehicle(kind, physics=drag, mass_center=(0.0, 0.0, 0.0))
    driven = drive_vehicle(vehicle, towards((0.4, 0.0, 0.0), 800))
    load = 15.0 * GRAVITY / vehicle.count
    axles = [math.cos(math.atan2(wheel.y, wheel.x)) for wheel in vehicle.wheels]
    lost = sum(0.1 * load * abs(0.4 * axle) for axle in axles)
    mechanical = float((driven.steps.torque[-1] * driven.steps.speed[-1]).sum())
    assert mechanical == pytest.approx(lost, rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_speeding_up_moves_load_and_with_it_friction(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, kind: str
) -> None:
    """Loads take the moment m a h; a is 0.8 m/s^2, and what the loop adds while it settles."""
    rolling = {"contact.rolling_resistance": {"coefficient": 0.02}}
    vehicle = make_vehicle(
        kind, further=rolling, mass_center=(0.0, 0.0, 0.12), acceleration_limit=0.8
    )
    driven = drive_vehicle(vehicle, towards((2.0, 0.0, 0.0), 100))
    loads = driven.wheels[60, :, at.WHEEL_LOAD]
    places = [wheel.x for wheel in vehicle.wheels]
    if kind == "two_driven":  # in the middle
        np.testing.assert_allclose(loads, 15.0 * GRAVITY / 4.0, rtol=1e-9)
    else:
        assert loads.sum() == pytest.approx(15.0 * GRAVITY)
        along = (driven.twist[59, 0] - driven.twist[58, 0]) / 0.005
        assert along == pytest.approx(0.8, rel=0.05)
        assert loads @ places == pytest.approx(-15.0 * 0.12 * along, rel=1e-6)


def test_two_wheels_cannot_be_commanded_sideways(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle
) -> None:
    driven = drive_vehicle(make_vehicle("two_driven"), towards((0.0, 0.5, 0.0), 100))
    assert np.abs(driven.twist).max() < 1e-12
