"""Loops of many robots at once against the loop of one."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.physics.effects import COPPER
from tomr_power_model.physics.model import PhysicalModel
from tomr_power_model.response.closed_loop import ClosedLoop, LoopState
from tomr_power_model.response.many import ManyLoops, Stretches
from tomr_power_model.response.sliding import Sliding
from tomr_power_model.robot import GRAVITY, Robot, shipped_robot

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


def test_warm_windings_cost_copper_and_leave_torque_alone(robot: Robot) -> None:
    """50 K: R grows by 0.393 % per kelvin, the current of a steady spin stays."""
    given = stretches(robot, np.tile([0.0, 0.0, 1.0], (STEPS, 1)))
    cold = ManyLoops.of([robot]).run(given)
    warm = ManyLoops.of([robot]).run(evolve(given, warm=np.full((1, 1, STEPS, 3), 50.0)))
    part = COPPER * 50.0
    np.testing.assert_allclose(warm.copper[-1], (1.0 + part) * cold.copper[-1], rtol=1e-3)
    more = warm.power[-1] - cold.power[-1]
    np.testing.assert_allclose(more, part * cold.copper[-1], rtol=2e-2)


def test_speeding_up_leans_on_the_wheels_behind(robot: Robot) -> None:
    """Wheels 2 and 3 stand behind: with the mass centre at a height h they carry m a h / (3 R) more
    each, half of what wheel 1 loses, when the robot speeds up forwards.
    """
    rolling = ({"coefficient": 0.1},) * 3
    robot = evolve(robot, physics={**robot.physics, "contact.rolling_resistance": rolling})
    flat = evolve(robot, mass_center=(0.0, 0.0, 0.0))
    forwards = np.zeros((STEPS, 3))
    forwards[:, 0] = 1.0 * 0.005 * np.arange(STEPS)  # 1 m/s^2
    height = robot.mass_center[2]
    for direction in (1.0, -1.0):
        given = stretches(robot, direction * forwards)
        high, low = (ManyLoops.of([item]).run(given) for item in (robot, flat))
        more = direction * robot.mass * 1.0 * height / (3.0 * robot.robot_radius)
        torque = 0.1 * robot.wheel_radius * more
        change = np.abs(high.current[60, 0, 0, 1:]) - np.abs(low.current[60, 0, 0, 1:])
        np.testing.assert_allclose(change, torque / robot.motors[0].wheel_constant, rtol=0.05)


@pytest.mark.parametrize("integral", [0.0, 60.0])
def test_drivers_of_one_kilohertz_are_the_same_in_coarse_steps(integral: float) -> None:
    """Taken as continuous, five of their periods at a time; they saturate where they start."""
    robot = shipped_robot("robotino_v2")
    robot = evolve(robot, controller=evolve(robot.controller, integral=integral))
    loop = ClosedLoop.of(robot, PhysicalModel.of(robot), 0.001)
    state, alone = LoopState(), []
    for x, y, z in np.repeat(tour(), 5, axis=0).tolist():
        state = loop.step(state, (x, y, z))
        alone.append(state.measured)
    expected = np.array(alone).reshape(STEPS, 5, 3).mean(axis=1)
    runs = ManyLoops.of([robot]).run(stretches(robot, tour()))
    together = runs.speed[:, 0, 0]
    error = np.abs(together - expected)
    assert np.abs(expected).max() > 7.0  # rad/s
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.9) < 0.15  # what is more is within steps of a jump
    k, resistance = robot.motors[0].wheel_constant, robot.motors[0].resistance
    current = runs.current[:, 0, 0]
    np.testing.assert_allclose(runs.copper[:, 0, 0], resistance * current**2)
    np.testing.assert_allclose(
        runs.power[:, 0, 0], resistance * current**2 + k * together * current, atol=0.02
    )


def _gripping(robot: Robot, friction: float) -> Robot:
    slips = ({"friction": friction},) * 3
    return evolve(robot, physics={**robot.physics, "contact.slip": slips})


def test_a_grip_that_is_never_needed_changes_nothing(robot: Robot) -> None:
    low = evolve(robot, mass_center=(0.0, 0.0, 0.0))  # no wheel is lifted at the stop
    given = stretches(low, tour())
    rolls, grips = (ManyLoops.of([item]).run(given) for item in (low, _gripping(low, 50.0)))
    np.testing.assert_allclose(grips.speed, rolls.speed, atol=1e-9)
    np.testing.assert_allclose(grips.power, rolls.power, atol=1e-9)


def test_wheels_that_slide_push_with_friction_times_load() -> None:
    """Straight on, two wheels at 60 degrees: a = 2 sin(60) mu g / 3, wheels by what is left."""
    robot = shipped_robot("reference")
    body, friction, torque, h = PhysicalModel.of(robot).body, 0.2, 5.0, 0.005
    still = np.zeros((1, 1, 3))
    inertia = body.wheel_inertia[None, None]
    pushes = torque * np.sign(np.linalg.inv(body.to_twist)[:, 0].round(9))[None, None]
    sliding = Sliding.of(
        grip=np.full((1, 1, 3), friction),
        radius=np.full((1, 1, 3), robot.wheel_radius),
        to_twist=body.to_twist.T[None],
        mass_matrix=body.mass_matrix[None],
        inertia=inertia,
        damping=np.full((1, 1, 3), 1e-9),
        turning=body.turning[None],
        axles=body.axles,
        duration=h,
        speed=still,
    )
    speed, normal = still, body.normal[None, None]
    for _ in range(20):
        rolling = speed + 100.0 * pushes  # would need far more traction than there is
        speed, _, yaw = sliding.step(speed, rolling, pushes, still, still, normal, still, still)
    along = 2.0 * np.sin(np.pi / 3.0) * friction * GRAVITY / 3.0
    assert sliding.twist[0, 0] == pytest.approx([20 * h * along, 0.0, 0.0], rel=1e-6, abs=1e-9)
    left = torque - robot.wheel_radius * friction * robot.mass * GRAVITY / 3.0
    assert np.abs(speed[0, 0, 1:]) == pytest.approx(20 * h * left / inertia[0, 0, 1:], rel=1e-6)
    assert yaw == pytest.approx(0.0, abs=1e-9)


def test_a_wheel_that_slid_rolls_again(robot: Robot) -> None:
    """After the hard start: the loop has the wheels where those of the rolling robot are."""
    time = np.arange(STEPS) * 0.005
    twists = np.stack([0.6 * (time > 0.1), 0.0 * time, 0.0 * time], axis=1)
    given = stretches(robot, twists)
    rolls, grips = (ManyLoops.of([item]).run(given) for item in (robot, _gripping(robot, 0.15)))
    assert np.abs(rolls.speed - grips.speed)[20:60].max() > 1.0
    np.testing.assert_allclose(grips.speed[-1], rolls.speed[-1], atol=0.05)
    np.testing.assert_allclose(grips.yaw_rate[-1], 0.0, atol=1e-3)


def test_a_ripple_follows_the_angle_as_measured(robot: Robot) -> None:
    """Told half a wave further on, a ripple does the opposite; a whole one, the same."""
    order = 4.0
    wavy = ({"torque": 0.05, "order": order, "phase": 0.3},) * 3
    rough = evolve(robot, physics={**robot.physics, "drivetrain.torque_ripple": wavy})
    given = stretches(robot, tour())
    smooth = ManyLoops.of([robot]).run(given)
    angle = np.cumsum(smooth.speed[:, 0], axis=0).transpose(1, 0, 2) * 0.005
    started = slice(20, 60)
    added = [
        (ManyLoops.of([rough]).run(evolve(given, told=angle + shift)).power - smooth.power)[started]
        for shift in (0.0, np.pi / order, 2.0 * np.pi / order)
    ]
    np.testing.assert_allclose(added[2], added[0], atol=1e-9)
    assert np.corrcoef(added[0].ravel(), added[1].ravel())[0, 1] < -0.9
