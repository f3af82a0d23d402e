"""The expected response to a command: limits, steady states, symmetry, standstill."""

import math

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.model import PhysicalModel
from tomr_power_model.response.closed_loop import ClosedLoop, LoopState, Triple
from tomr_power_model.robot import Robot, shipped_robot

STEP = 0.005


def _run(robot: Robot, command: Triple, seconds: float) -> list[LoopState]:
    loop = ClosedLoop.of(robot, PhysicalModel.of(robot), STEP)
    states = [LoopState()]
    for _ in range(round(seconds / STEP)):
        states.append(loop.step(states[-1], command))
    return states


def test_the_integral_brings_the_wheels_to_the_set_speed() -> None:
    robot = shipped_robot("reference")
    command = (0.3, -0.2, 0.4)
    reached = np.array(_run(robot, command, 5.0)[-1].speed)
    np.testing.assert_allclose(reached, twist_to_wheels(robot) @ command, rtol=1e-4)


def test_a_proportional_loop_stays_slower_by_hand() -> None:
    # Steady: k_p (set - w) = R (tau_c + b w) / k + k w, one equation for each wheel.
    robot = shipped_robot("reference")
    robot = evolve(robot, controller=evolve(robot.controller, integral=0.0))
    reached = _run(robot, (0.4, 0.0, 0.0), 5.0)[-1].speed
    wanted = 0.4 * math.sin(2.0 * math.pi / 3.0) / 0.05
    resistance, constant, gain = 0.8, 0.7, 1.2
    friction = 0.06 * resistance / constant
    damping = constant + 0.004 * resistance / constant
    assert reached[1] == pytest.approx((gain * wanted - friction) / (gain + damping), rel=1e-3)


def test_the_ramp_limits_the_body_acceleration() -> None:
    states = _run(shipped_robot("reference"), (0.3, 0.4, 0.0), 0.2)
    speeds = [math.hypot(*state.twist[:2]) for state in states]
    assert np.diff(speeds).max() == pytest.approx(2.0 * STEP)
    assert states[-1].twist[0] / states[-1].twist[1] == pytest.approx(0.75)


def test_friction_holds_a_wheel_that_is_hardly_driven() -> None:
    # 1 mm/s asks for 0.017 rad/s: without an integral the loop's torque is far below friction.
    robot = shipped_robot("reference")
    robot = evolve(robot, controller=evolve(robot.controller, integral=0.0))
    assert max(map(abs, _run(robot, (0.001, 0.0, 0.0), 1.0)[-1].speed)) < 1e-9


def test_saturation_limits_the_speed() -> None:
    robot = shipped_robot("reference")
    reached = _run(robot, (10.0, 0.0, 0.0), 8.0)[-1].speed
    assert max(map(abs, reached)) < 24.0 / 0.7


def test_a_turn_by_120_degrees_only_moves_the_labels() -> None:
    robot = shipped_robot("reference")
    turn = 2.0 * math.pi / 3.0
    straight = _run(robot, (0.4, 0.0, 0.0), 1.0)
    turned = _run(robot, (0.4 * math.cos(turn), 0.4 * math.sin(turn), 0.0), 1.0)
    np.testing.assert_allclose(
        [state.speed for state in turned],
        np.roll([state.speed for state in straight], 1, axis=1),
        atol=1e-9,
    )
