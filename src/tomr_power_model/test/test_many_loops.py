"""Loops of many robots at once against the loop of one."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.model import PhysicalModel
from tomr_power_model.response.closed_loop import ClosedLoop, LoopState
from tomr_power_model.response.many import ManyLoops, Stretches
from tomr_power_model.robot import Robot, shipped_robot

STEPS = 400  # of 5 ms


@pytest.fixture
def robot() -> Robot:
    return shipped_robot("reference")


def stretches(robot: Robot, twists: np.ndarray, prompt: bool = True) -> Stretches:
    """One stretch from rest; `twists` (steps, 3) are set points as the ramp leaves them."""
    set_speed = (twists @ twist_to_wheels(robot).T)[None, None]
    still = np.zeros((1, 3))
    return Stretches(set_speed, still, still, still, np.zeros(1), prompt=prompt)


def tour() -> np.ndarray:
    """A start, a turn and a stop."""
    time = np.arange(STEPS) * 0.005
    along = np.clip(2.0 * time, 0.0, 0.4) * (time < 1.5)
    turning = 1.5 * (time > 0.8) * (time < 1.2)
    return np.stack([along, 0.3 * along, turning], axis=1)


def test_the_same_motion_as_the_loop_of_one(robot: Robot) -> None:
    free = evolve(robot, controller=evolve(robot.controller, acceleration_limit=0.0))
    loop = ClosedLoop.of(free, PhysicalModel.of(free), 0.005)
    state, alone = LoopState(), []
    for x, y, z in tour().tolist():
        state = loop.step(state, (x, y, z))
        alone.append(state.measured)
    together = ManyLoops.of([free]).run(stretches(free, tour())).speed[:, 0, 0]
    assert np.abs(together - np.array(alone)).max() < 0.05  # of 8 rad/s
    assert np.abs(together).max() > 4.0


def test_variants_do_not_know_of_each_other(robot: Robot) -> None:
    heavy = evolve(robot, mass=2.0 * robot.mass)
    given = stretches(robot, tour())
    both = ManyLoops.of([robot, heavy]).run(given)
    for number, variant in enumerate((robot, heavy)):
        alone = ManyLoops.of([variant]).run(given)
        np.testing.assert_allclose(both.power[:, number], alone.power[:, 0], rtol=1e-9, atol=1e-9)
    started = slice(0, 60)  # the straight start; spins saturate the drivers either way
    assert both.power[started, 1].max() > 1.2 * both.power[started, 0].max()


def test_a_robot_turned_by_a_third_draws_the_same_power(robot: Robot) -> None:
    """Turning the robot by 120 degrees renames its wheels."""
    twists = tour()
    third = 2.0 * np.pi / 3.0
    turn = np.array(
        [[np.cos(third), -np.sin(third), 0], [np.sin(third), np.cos(third), 0], [0, 0, 1]]
    )
    power = ManyLoops.of([robot]).run(stretches(robot, twists)).power[:, 0, 0]
    turned = ManyLoops.of([robot]).run(stretches(robot, twists @ turn.T)).power[:, 0, 0]
    np.testing.assert_allclose(turned, np.roll(power, 1, axis=1), atol=1e-6)


def test_steady_power_by_hand(robot: Robot) -> None:
    """Spinning steadily: P = v i + standby with i from friction alone."""
    twists = np.tile([0.0, 0.0, 1.5], (STEPS, 1))
    run = ManyLoops.of([robot]).run(stretches(robot, twists))
    speed = float(run.speed[-1, 0, 0, 0])
    motor = robot.motors[0]
    coulomb, viscous = robot.effect("friction.coulomb"), robot.effect("friction.viscous")
    standby = robot.effect("electrical.driver_standby")
    assert coulomb is not None
    assert viscous is not None
    assert standby is not None
    torque = -coulomb["torque"] + viscous["coefficient"] * speed  # the wheel turns backwards
    current = torque / motor.wheel_constant
    volts = motor.resistance * current + motor.wheel_constant * speed
    drawn = float(run.power[-1, 0, 0, 0]) - standby["power"]
    assert speed == pytest.approx(-1.5 * robot.robot_radius / robot.wheel_radius, rel=1e-3)
    assert drawn == pytest.approx(volts * current, rel=0.01)


def test_dry_friction_holds_a_robot_on_a_slope_that_is_too_flat_to_move_it(robot: Robot) -> None:
    tilted = evolve(
        robot, physics={**robot.physics, "body.slope": ({"angle": 0.002, "azimuth": 0.0},) * 3}
    )
    run = ManyLoops.of([tilted]).run(stretches(tilted, np.zeros((STEPS, 3))))
    assert np.abs(run.speed).max() < 1e-6
