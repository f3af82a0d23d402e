"""Motors with open terminals: their wheels roll on as if there were no motor."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.simulation import Excitation, Variant, drive
from tomr_power_model.dynamics.vehicle import Vehicle, vehicle_of
from tomr_power_model.robot import shipped_robot


@pytest.mark.parametrize("friction", [None, 0.9])
def test_a_push_accelerates_mass_and_rotating_parts_only(friction: float | None) -> None:
    """F = (m + 3/2 J / r^2) a for three omni wheels, their windings carry no current."""
    robot = shipped_robot("reference")
    grip = {} if friction is None else {"contact.slip": ({"friction": friction},) * 3}
    robot = evolve(robot, physics=grip, mass_center=(0.0, 0.0, 0.12))
    inputs = np.tile(no_input(3), (200, 1))
    inputs[:, at.INPUT_HEADER + at.CONNECTED :: at.INPUT_WHEEL] = 0.0
    inputs[:, at.PUSH + 1] = 6.0
    rest = np.zeros(3)
    steps = drive(
        Variant(laid_out(vehicle_of(robot))), Excitation(0.0, inputs, rest, rest, 0.0, rest)
    )
    motor = robot.motors[0]
    inertia = robot.wheel_inertia + motor.gear_ratio**2 * motor.rotor_inertia
    heavy = robot.mass + 1.5 * inertia / robot.wheel_radius**2
    speed = 6.0 / heavy * 0.9975 / robot.wheel_radius  # in the middle of the last period
    np.testing.assert_allclose(steps.speed[-1], speed * np.array([-1.0, 0.5, 0.5]), rtol=2e-3)
    assert not steps.current.any()


def test_a_turning_push_accelerates_the_inertia(make_vehicle: Callable[..., Vehicle]) -> None:
    """M = (I + 3 J (R / r)^2) a."""
    vehicle = make_vehicle(physics={}, mass_center=(0.0, 0.0, 0.12))
    inputs = np.tile(no_input(3), (200, 1))
    inputs[:, at.INPUT_HEADER + at.CONNECTED :: at.INPUT_WHEEL] = 0.0
    inputs[:, at.PUSH + 2] = 0.5
    rest = np.zeros(3)
    steps = drive(Variant(laid_out(vehicle)), Excitation(0.0, inputs, rest, rest, 0.0, rest))
    heavy = 0.35 + 3.0 * 2.6e-3 * (0.2 / 0.05) ** 2
    # The back-EMF is given back at the start of each step.
    np.testing.assert_allclose(steps.yaw_rate[-1], 0.5 / heavy * 0.9975, rtol=0.01)
