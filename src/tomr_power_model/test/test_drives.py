"""Kinematics and power: numbers worked by hand, and symmetries that any robot must keep."""

import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.drives import InverseDynamics, WheelMotion
from tomr_power_model.geometry.kinematics import twist_to_wheels, wheels_to_twist
from tomr_power_model.robot import Robot, shipped_robot

SPEEDS = st.floats(-2.0, 2.0)


@pytest.fixture(name="robot")
def _robot() -> Robot:
    return shipped_robot("reference")


def test_kinematics_by_hand(robot: Robot) -> None:
    # Wheels at 0, 120, 240 degrees, R = 0.2 m, r = 0.05 m; r omega = sin vx - cos vy - R wz.
    half, root = 0.5, math.sqrt(3.0) / 2.0
    matrix = twist_to_wheels(robot)
    np.testing.assert_allclose(matrix @ [1.0, 0.0, 0.0], np.array([0.0, root, -root]) / 0.05)
    np.testing.assert_allclose(matrix @ [0.0, 1.0, 0.0], np.array([-1.0, half, half]) / 0.05)
    np.testing.assert_allclose(matrix @ [0.0, 0.0, 1.0], np.array([-4.0, -4.0, -4.0]))


@given(vx=SPEEDS, vy=SPEEDS, wz=SPEEDS, offset=st.floats(-math.pi, math.pi))
def test_kinematics_inverts(vx: float, vy: float, wz: float, offset: float) -> None:
    robot = evolve(shipped_robot("reference"), wheel_offset=offset)
    twist = np.array([vx, vy, wz])
    back = wheels_to_twist(robot) @ twist_to_wheels(robot) @ twist
    np.testing.assert_allclose(back, twist, atol=1e-12)


def test_steady_power_by_hand(robot: Robot) -> None:
    # Along +x at 0.4 m/s wheel 2 turns at 0.4 * 0.866 / 0.05 = 6.9282 rad/s against 0.06 +
    # 0.004 * 6.9282 = 0.087713 N m; k = 0.7 N m/A, R = 0.8 ohm, standby 1.2 W.
    speed = twist_to_wheels(robot) @ [0.4, 0.0, 0.0]
    power = InverseDynamics.of(robot).power(WheelMotion(speed[None, :], np.zeros((1, 3))))
    current = 0.087713 / 0.7
    expected = current * (0.8 * current + 0.7 * 6.9282) + 1.2
    np.testing.assert_allclose(power.power[0], [1.2, expected, expected], rtol=1e-4)


@given(vx=SPEEDS, vy=SPEEDS, wz=SPEEDS, ax=SPEEDS, ay=SPEEDS, az=SPEEDS)
def test_a_turn_by_120_degrees_only_moves_the_labels(
    vx: float, vy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """Rotate the command by 120 degrees: each wheel's power passes to the next wheel."""
    robot = shipped_robot("reference")
    model, matrix = InverseDynamics.of(robot), twist_to_wheels(robot)
    turn = 2.0 * math.pi / 3.0
    cosine, sine = math.cos(turn), math.sin(turn)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def power(velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        motion = WheelMotion((matrix @ velocity)[None, :], (matrix @ acceleration)[None, :])
        return np.asarray(model.power(motion).power[0])

    velocity, acceleration = np.array([vx, vy, wz]), np.array([ax, ay, az])
    straight = power(velocity, acceleration)
    turned = power(rotation @ velocity, rotation @ acceleration)
    np.testing.assert_allclose(turned, np.roll(straight, 1), rtol=1e-9, atol=1e-9)


@given(vx=SPEEDS, vy=SPEEDS, wz=SPEEDS, ax=SPEEDS, ay=SPEEDS, az=SPEEDS)
def test_energy_is_conserved(
    vx: float, vy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """Electrical power = copper loss + friction + rate of kinetic energy, at every instant."""
    robot = evolve(shipped_robot("reference"), mass_center=(0.02, -0.01, 0.1))
    physics = {k: v for k, v in robot.physics.items() if k != "electrical.driver_standby"}
    robot = evolve(robot, physics=physics)
    model, matrix = InverseDynamics.of(robot), twist_to_wheels(robot)
    twist, rate = np.array([vx, vy, wz]), np.array([ax, ay, az])
    speed, acceleration = (matrix @ twist)[None, :], (matrix @ rate)[None, :]
    drives = model.power(WheelMotion(speed, acceleration))
    copper = 0.8 * (drives.current**2).sum()
    # Dry friction fades below 0.1 rad/s, where it cannot be determined.
    friction = ((0.06 * np.tanh(speed / 0.1) + 0.004 * speed) * speed).sum()
    kinetic = twist @ Body.of(robot).mass_matrix @ rate
    kinetic += 2.6e-3 * (speed[0] * acceleration[0]).sum()
    total = copper + friction + kinetic
    assert drives.power.sum() == pytest.approx(total, rel=1e-9, abs=1e-9)


def test_one_row_or_many_give_the_same_numbers(robot: Robot) -> None:
    random = np.random.default_rng(1)
    motion = WheelMotion(random.normal(0.0, 5.0, (50, 3)), random.normal(0.0, 20.0, (50, 3)))
    model = InverseDynamics.of(robot)
    together = model.power(motion).power
    for row in range(50):
        alone = WheelMotion(motion.speed[[row]], motion.acceleration[[row]])
        np.testing.assert_allclose(model.power(alone).power[0], together[row], rtol=1e-12)
