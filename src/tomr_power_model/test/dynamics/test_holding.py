"""What friction holds, by hand."""

import math

import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.holding import Holding
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import Robot, shipped_robot

NONE = (0.0, 0.0, 0.0)
REFERENCE = shipped_robot("reference")


def test_friction_of_an_axle_holds_its_own_wheel() -> None:
    found = Holding(vehicle_of(REFERENCE)).voltages((0.06, 0.0, 0.03), NONE, (0.8, 0.8, 1.6))
    # 0.7 N m/A at the wheel
    assert found == pytest.approx([0.06 / 0.7 * 0.8, 0.0, 0.03 / 0.7 * 1.6])


def test_rollers_hold_the_wheels_that_would_slide_them() -> None:
    found = Holding(vehicle_of(REFERENCE)).voltages(NONE, (2.0, 0.0, 0.0), (0.7, 0.7, 0.7))
    # A turn of wheel 1 alone moves the robot along 2/3 r of its rolling direction and does not
    # slide its own rollers; of wheels 2 and 3 it does, 2/3 r sin 120 deg.
    sideways = 2.0 / 3.0 * 0.05 * math.sin(math.radians(120.0)) * 2.0
    assert found == pytest.approx([0.0, sideways, sideways], abs=1e-12)


def _turns(robot: Robot, share: float) -> bool:
    """Whether wheel 1 turns under a share of what it is held against."""
    simulation = Simulation(vehicle_of(robot))
    state, inputs = simulation.start(), simulation.inputs()
    simulation.advance(state, inputs)
    fields = (simulation.of_wheels(state, part) for part in (at.DRY, at.SIDE_LIMIT, at.HOT))
    volts = Holding(vehicle_of(robot)).voltages(*fields)[0]
    simulation.add_to_sum(state, 0, share * volts / robot.controller.integral)
    for _ in range(20):
        simulation.advance(state, inputs)
    return abs(simulation.of_wheels(state, at.SPEED)[0]) > 1e-6


@pytest.mark.parametrize("drag", [0.0, 0.02])
def test_the_simulation_holds_as_much_and_no_more(drag: float) -> None:
    sets = {"coefficient": drag, "slip": 0.0}
    physics = {**REFERENCE.physics, "contact.roller_drag": (sets, sets, sets)}
    robot = evolve(REFERENCE, physics=physics)
    assert not _turns(robot, 0.98)
    assert _turns(robot, 1.05)
