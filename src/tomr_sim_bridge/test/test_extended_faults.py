"""Faults beyond the paper's three: each is as large as worked out by hand.

The reference robot: wheel radius 0.05 m, 15 kg, friction 0.06 N m + 0.004 N m s, motors of
0.8 ohm and 0.035 * 20 = 0.7 N m/A at the wheel, standby 1.2 W a driver.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.robot import Robot
from tomr_sim_bridge.faults import BodyMotion, FaultActions, FaultBoard, fault_ids, natures
from tomr_sim_bridge.plant.simulation import Simulation

MakeRobot = Callable[..., Robot]
SIDEWAYS = (0.0, 0.4, 0.0)  # wheel 1 turns at -8 rad/s
FORWARD = (
    0.3,
    0.0,
    0.0,
)  # wheels 2 and 3 at 0.3 * cos(30 deg) / 0.05 = 5.196 rad/s, wheel 1 stands
BODY = BodyMotion(
    time=2.0, mass=15.0, position=np.zeros(2), yaw=0.0, velocity=np.zeros(2), yaw_rate=0.0
)


def copper(torque: float, resistance: float = 0.8, constant: float = 0.7) -> float:
    """Copper loss [W] of a motor that gives a torque at the wheel [N m]."""
    return resistance * (torque / constant) ** 2


def steady(robot: Robot, drive: Callable, command: tuple, fault: str = "", **settings: object):  # type: ignore[no-untyped-def]
    """A drive at steady speed with a fault in force from the start."""
    simulation = Simulation(robot)
    if fault:
        simulation.set_fault(fault, **{"severity": 1.0, **settings})
    return drive(simulation, 5.0, command, skip=3.0)


def more_power(robot: Robot, drive: Callable, command: tuple, *fault: str, **settings: object):  # type: ignore[no-untyped-def]
    """What the drivers draw more [W], shape (3,)."""
    faulty = steady(robot, drive, command, *fault, **settings).motors().mean(axis=0)
    return faulty - steady(robot, drive, command).motors().mean(axis=0)


@pytest.mark.parametrize("severity", [0.5, 1.0])
def test_a_dragging_bearing_draws_its_torque_times_speed_and_the_copper(
    severity: float, make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot(ideal=True)
    more = more_power(
        robot, drive, SIDEWAYS, "bearing_dragging", wheel=1, torque=0.3, severity=severity
    )
    drag, own = 0.3 * severity, 0.06 + 0.004 * 8.0
    assert more[0] == pytest.approx(8.0 * drag + copper(own + drag) - copper(own), rel=0.02)
    assert more[1:] == pytest.approx([0.0, 0.0], abs=0.05)  # the speed loops hold the motion


def test_a_stuck_wheel_stands_while_its_motor_stalls(
    make_robot: MakeRobot, drive: Callable
) -> None:
    run = steady(make_robot(ideal=True), drive, SIDEWAYS, "wheel_stuck", wheel=1)
    assert np.abs(run.joints()[:, 0]) == pytest.approx(0.0, abs=0.02)
    assert run.motors()[-1, 0] == pytest.approx(24.0**2 / 0.8 + 1.2, rel=0.01)
    weak = steady(make_robot(ideal=True), drive, SIDEWAYS, "wheel_stuck", wheel=1, severity=0.02)
    assert weak.joints()[:, 0].mean() == pytest.approx(-8.0, rel=0.02)  # 0.8 N m: it still turns


def test_resistance_adds_copper_loss_and_nothing_else(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot({"physics.friction.coulomb.torque": 0.6}, ideal=True)
    more = more_power(robot, drive, SIDEWAYS, "motor_resistance_high", wheel=1, rise=0.5)
    assert more[0] == pytest.approx(0.5 * copper(0.6 + 0.032), rel=0.03)
    assert more[1:] == pytest.approx([0.0, 0.0], abs=0.02)


def test_a_weak_motor_takes_more_current_for_its_torque(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot({"physics.friction.coulomb.torque": 0.6}, ideal=True)
    more = more_power(robot, drive, SIDEWAYS, "motor_torque_weak", wheel=1, loss=0.3)
    torque = 0.6 + 0.032
    assert more[0] == pytest.approx(copper(torque, constant=0.49) - copper(torque), rel=0.03)


def test_a_low_supply_is_measured_and_the_speed_loop_makes_up_for_it(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot(ideal=True)
    low = steady(robot, drive, SIDEWAYS, "supply_low", undervoltage=6.0, severity=0.5)
    assert low.supply("battery_state", "voltage") == pytest.approx(21.0, abs=0.01)
    assert low.joints()[:, 0].mean() == pytest.approx(-8.0, rel=0.005)
    normal = steady(robot, drive, SIDEWAYS)
    assert low.motors().mean(axis=0) == pytest.approx(normal.motors().mean(axis=0), abs=0.02)


@pytest.mark.parametrize(
    ("fault", "settings", "force"),
    [
        ("load_towed", {"drag": 12.0}, 12.0),
        ("pushed", {"force": 0.5, "azimuth": math.pi}, 7.5),  # 0.5 N/kg, against the motion
        ("windy", {"speed": 9.7, "drag_area": 0.2, "azimuth": math.pi}, 12.0),  # 0.12 * (10 m/s)^2
    ],
)
def test_a_force_against_the_motion_is_paid_for_by_the_motors_that_pull(
    fault: str,
    settings: dict[str, float],
    force: float,
    make_robot: MakeRobot,
    drive: Callable,
) -> None:
    more = more_power(make_robot(ideal=True), drive, FORWARD, fault, **settings)
    # Wheels 2 and 3 pull at 30 degrees from x: each the force / (2 cos 30 deg), at 5.196 rad/s.
    torque, own = 0.05 * force / 1.7321, 0.06 + 0.004 * 5.196
    one = 5.196 * torque + copper(own + torque) - copper(own)
    assert more[1:] == pytest.approx([one, one], rel=0.04)
    assert more[0] == pytest.approx(0.0, abs=0.05)


def test_a_push_through_a_lever_turns_the_robot_anticlockwise(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    simulation.set_fault("drivers_off", severity=1.0)
    simulation.set_fault("pushed", severity=1.0, lever=0.3)
    run = drive(simulation, 0.3)
    assert run.twist()[-1, 0] > 0.1
    assert run.twist()[-1, 2] > 0.1


def test_a_push_moves_the_robot_its_way(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot({"physics.friction.coulomb.torque": 0.0}, ideal=True))
    simulation.set_fault("drivers_off", severity=1.0)
    simulation.set_fault("pushed", severity=1.0, azimuth=math.pi / 2.0)
    run = drive(simulation, 0.3)
    assert run.twist()[-1, 1] > 0.1
    assert np.abs(run.twist()[-1, [0, 2]]) == pytest.approx(0.0, abs=0.02)


def pushed_by(fault: str, body: BodyMotion, *before: BodyMotion, **settings: object) -> list[float]:
    """Force in the world [N, N] and moment [N m] of a fault on the body, after it has seen more."""
    board = FaultBoard()
    board.set(fault, {"severity": 1.0, **settings})
    moments = [
        board.actions(np.zeros((3, 2)), np.ones(3), moment).push for moment in (*before, body)
    ]
    return [float(value) for value in moments[-1]]


def test_a_lean_grows_slowly() -> None:
    later = evolve(BODY, time=3.0)
    assert pushed_by("pushed", BODY, force=1.0, rise=4.0) == [0.0, 0.0, 0.0]
    assert pushed_by("pushed", later, BODY, force=1.0, rise=4.0) == pytest.approx([3.75, 0.0, 0.0])
    assert pushed_by("pushed", BODY, force=1.0) == pytest.approx([15.0, 0.0, 0.0])


def test_a_towed_load_pulls_at_its_hitch() -> None:
    sideways = evolve(BODY, velocity=np.array([0.0, 1000.0]))  # so that nothing creeps
    assert pushed_by("load_towed", sideways, drag=10.0, hitch=-0.5) == pytest.approx([0, -10, 5])
    assert pushed_by("load_towed", BODY) == pytest.approx([0.0, 0.0, 0.0])
    turning = evolve(BODY, yaw_rate=1000.0)  # the hitch moves along -y
    assert pushed_by("load_towed", turning, drag=10.0, hitch=-0.5) == pytest.approx([0, 10, -5])


def test_a_tether_is_slack_first() -> None:
    def at(x: float) -> BodyMotion:
        return evolve(BODY, position=np.array([x, 0.0]))

    assert pushed_by("tethered", at(1.15), at(1.0), slack=0.2) == [0.0, 0.0, 0.0]
    pull = pushed_by("tethered", at(1.5), at(1.0), slack=0.2, stiffness=20.0)
    assert pull == pytest.approx([-6.0, 0.0, 0.0])


def test_drivers_that_are_off_let_the_robot_roll_out(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    drive(simulation, 2.0, SIDEWAYS)
    simulation.set_fault("drivers_off", severity=1.0)
    run = drive(simulation, 4.0, skip=0.02)
    assert run.motors() == pytest.approx(1.2, abs=1e-6)
    assert np.abs(run.joints()[-1]) == pytest.approx(0.0, abs=0.05)


def test_withheld_commands_stop_the_robot_or_slow_it(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    drive(simulation, 2.0, SIDEWAYS)
    simulation.set_fault("commands_ignored", severity=0.5)
    assert drive(simulation, 2.0, skip=1.0).joints()[:, 0].mean() == pytest.approx(-4.0, rel=0.01)
    simulation.set_fault("commands_ignored", severity=1.0)
    run = drive(simulation, 2.0, skip=1.0)
    assert np.abs(run.joints()).max() < 0.05


def test_a_power_sensor_is_off_by_a_factor_or_a_bias(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot(ideal=True)
    true = steady(robot, drive, SIDEWAYS).motors().mean(axis=0)
    half = steady(robot, drive, SIDEWAYS, "power_sensor_scaled", wheel=1, severity=0.6)
    assert half.motors().mean(axis=0) == pytest.approx(true * [0.7, 1.0, 1.0], rel=0.01)
    more = steady(robot, drive, SIDEWAYS, "power_sensor_biased", wheel=2, bias=-3.0, severity=0.5)
    assert more.motors().mean(axis=0) == pytest.approx(true - [0.0, 1.5, 0.0], abs=0.02)
    battery = half.power("battery_state").mean()
    assert battery == pytest.approx(true.sum() + 12.0, rel=0.01)  # the robot draws what it did


def test_a_frozen_power_sensor_repeats_itself_to_the_bit(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot())
    before = drive(simulation, 1.0, SIDEWAYS).motors()
    simulation.set_fault("power_sensor_frozen", wheel=1, severity=1.0)
    frozen = drive(simulation, 1.0).motors()
    assert set(frozen[1:, 0]) == {frozen[0, 0]}
    assert frozen[0, 0] == pytest.approx(before[-1, 0], abs=1.0)
    assert len(set(frozen[:, 1])) > 3
    simulation.set_fault("power_sensor_frozen", wheel=1)
    assert len(set(drive(simulation, 1.0).motors()[1:, 0])) > 3


def test_a_dead_power_sensor_says_nothing(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot())
    drive(simulation, 0.2)
    simulation.set_fault("power_sensor_dead", wheel=2, severity=1.0)
    run = drive(simulation, 1.0)
    assert not run.fields("wheel_2/power")
    full = len(run.fields("wheel_1/power"))
    assert full > 40
    simulation.set_fault("power_sensor_dead", wheel=2, severity=0.4)
    assert 0.4 < len(drive(simulation, 1.0).fields("wheel_2/power")) / full < 0.8


@pytest.mark.parametrize(
    ("source", "topic", "field"),
    [("multi_array", "power", "data"), ("joint_effort", "joint_states", "effort")],
)
def test_a_dead_power_sensor_is_nan_where_wheels_share_a_message(
    source: str, topic: str, field: str, make_robot: MakeRobot, drive: Callable
) -> None:
    changes = {"measurement.source": source, "measurement.quantity": "motor_current"}
    simulation = Simulation(make_robot(changes))
    simulation.set_fault("power_sensor_dead", wheel=2, severity=1.0)
    values = drive(simulation, 0.3, skip=0.1).fields(topic)[-1][field]
    assert [math.isnan(value) for value in values] == [False, True, False]


@pytest.mark.parametrize("fault", fault_ids())
def test_every_fault_moves_what_is_measured(
    fault: str, make_robot: MakeRobot, drive: Callable
) -> None:
    def run(severity: float):  # type: ignore[no-untyped-def]
        simulation = Simulation(make_robot(ideal=True))
        drive(simulation, 0.2, (0.4, 0.3, 0.2))
        simulation.set_fault(fault, severity=severity)
        return drive(simulation, 0.8)

    sick, well = run(1.0), run(0.0)
    samples = [
        [s.message for s in r.samples if s.topic == "joint_states" or s.topic.endswith("power")]
        for r in (sick, well)
    ]
    assert samples[0] != samples[1]
    assert sick.truth(fault)[-1]["active"] == 1.0


def test_the_page_of_faults_names_them_all() -> None:
    page = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8")
    kinds = natures()
    for fault_id in fault_ids():
        line = next(line for line in page.splitlines() if line.startswith(f"| `{fault_id}`"))
        assert kinds[fault_id] in line


def test_actions_are_neutral_at_first() -> None:
    actions = FaultActions(np.zeros((3, 2)), np.ones(3), BODY)
    assert actions.connected.all()
    for name in ("drive", "encoder", "resistance", "constant", "meter_scale"):
        assert getattr(actions, name) == pytest.approx(1.0)
    for name in ("dry", "push", "meter_bias", "meter_frozen", "meter_lost"):
        assert getattr(actions, name) == pytest.approx(0.0)
