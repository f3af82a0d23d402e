"""Each fault does what it says, and says what it does."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_sim_bridge.faults import FaultBoard, all_parameters, fault_ids, split_name
from tomr_sim_bridge.plant.simulation import Simulation

MakeRobot = Callable[..., Robot]
DOCUMENTED = Path(__file__).parents[3] / "docs" / "faults.md"
SIDEWAYS = (0.0, 0.4, 0.0)  # wheel 1 does most


def test_control_signal_lost_leaves_the_motor_without_current(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    drive(simulation, 2.0, SIDEWAYS)
    simulation.set_fault("control_signal_lost", wheel=1)
    assert drive(simulation, 0.5, skip=0.2).motors()[:, 0].mean() > 1.5  # severity 0: off
    simulation.set_fault("control_signal_lost", wheel=1, severity=1.0)
    run = drive(simulation, 2.5, skip=0.02)
    assert run.motors()[:, 0] == pytest.approx(1.2, abs=1e-6)  # standby only
    assert run.motors()[-1, 1] > 1.4  # the others drive on
    assert np.abs(run.joints()[-1, 0]) < 1.0  # friction stops the wheel
    # wheel 1 stands, the others turn at 4 rad/s: -(4 + 4) * 0.05 / (3 * 0.2)
    assert run.twist()[-5:, 2].mean() == pytest.approx(-0.667, rel=0.03)
    simulation.set_fault("control_signal_lost")
    assert drive(simulation, 2.0, skip=1.5).joints()[:, 0].mean() == pytest.approx(-8.0, abs=0.05)


def test_control_signal_partly_lost_scales_the_voltage(
    make_robot: MakeRobot, drive: Callable
) -> None:
    robot = make_robot({"controller.integral": 0.0}, ideal=True)

    def speed(severity: float) -> float:
        simulation = Simulation(robot)
        simulation.set_fault("control_signal_lost", wheel=1, severity=severity)
        return float(drive(simulation, 3.0, SIDEWAYS, skip=2.5).joints()[:, 0].mean())

    # v = s kp (set - w), and v = k w + R (friction + drag of the rest) / k at steady speed
    assert speed(0.0) < speed(0.5) < speed(0.9) < -0.1


def test_shorted_terminals_brake_the_wheel(make_robot: MakeRobot, drive: Callable) -> None:
    speed = {}
    for terminals in ("open", "shorted"):
        simulation = Simulation(make_robot({"physics.friction.coulomb.torque": 0.0}, ideal=True))
        drive(simulation, 2.0, SIDEWAYS)
        simulation.set_fault("control_signal_lost", wheel=1, severity=1.0, terminals=terminals)
        run = drive(simulation, 1.0, skip=0.5)
        assert run.motors()[:, 0] == pytest.approx(1.2, abs=1e-6)  # standby: no voltage, no power
        speed[terminals] = float(np.abs(run.joints()[:, 0]).mean())
    assert speed["shorted"] < 0.7 * speed["open"]


def test_encoder_lost_freezes_the_position_and_spins_the_robot(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    drive(simulation, 1.5, SIDEWAYS)
    simulation.set_fault("encoder_lost", wheel=1, severity=1.0)
    run = drive(simulation, 2.5, skip=0.01)
    position = run.joints("position")
    assert np.ptp(position[:, 0]) == 0.0
    assert np.ptp(position[:, 1]) > 1.0
    assert run.joints()[1:, 0] == pytest.approx(0.0)
    # 24 V over 0.7 V s/rad is 34 rad/s at most: wheel 1 runs backward at about that
    turning = run.twist()[-1, 2]
    assert turning == pytest.approx((34.0 - 8.0) * 0.05 / (3.0 * 0.2), rel=0.1)
    assert run.motors()[:, 0].max() > 10.0


def test_encoder_partly_lost_counts_less(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot(ideal=True))
    simulation.set_fault("encoder_lost", wheel=2, severity=0.2)
    run = drive(simulation, 5.0, (0.0, 0.0, -0.5), skip=4.0)
    assert run.joints()[:, 1].mean() == pytest.approx(2.0, rel=0.005)  # by its encoder
    # 2.0 / 0.8 rad/s in truth: yaw by a third of the excess of 0.5 rad/s * r / R
    assert run.twist()[:, 2].mean() == pytest.approx(-0.5 - 0.5 * 0.05 / 0.2 / 3.0, rel=0.01)


def test_slippery_floor_limits_acceleration(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot({"controller.acceleration_limit": 0.0}, ideal=True))
    simulation.set_fault("floor_slippery", severity=1.0)
    run = drive(simulation, 0.5, (0.6, 0.0, 0.0))
    speed = run.twist()[:, 0]
    limit = 0.02 * 9.80665  # wheels 2 and 3 pull at 30 degrees from x with a third of the load each
    assert speed[-1] / 0.5 < limit
    assert speed[-1] / 0.5 == pytest.approx(limit * 2.0 / 3.0 * 0.8660, rel=0.1)
    truth = run.truth("floor_slippery")[-1]
    assert truth["active"] == 1.0
    assert truth["slip_speed_wheel_2"] == pytest.approx(0.5, abs=0.1)
    assert truth["slip_speed_wheel_1"] == pytest.approx(0.0, abs=0.05)


def test_friction_falls_by_equal_factors(make_robot: MakeRobot) -> None:
    simulation = Simulation(make_robot())
    simulation.set_fault("floor_slippery", severity=0.5)
    simulation.step_to(5_000_000)
    geoms = simulation.engine.model.geom_friction[:, 0]
    # sqrt(0.8 * 0.02)
    assert sorted(set(geoms.round(6)))[0] == pytest.approx(0.126491, abs=1e-6)


def test_slippery_patch_is_felt_where_it_lies(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot())
    patch = {"severity": 1.0, "center_x": 0.8, "center_y": 0.0, "radius": 0.3}
    simulation.set_fault("floor_slippery", **patch)
    run = drive(simulation, 4.0, (0.5, 0.0, 0.0))
    active = np.array([values["active"] for values in run.truth("floor_slippery")])
    place = run.place()[:, 0]
    # the first contact lies 0.2 m before the centre, the last ones 0.1 m behind it
    assert not active[place < 0.28].any()
    assert active[(place > 0.32) & (place < 1.1)].all()
    assert not active[place > 1.22].any()


def test_truth_names_fault_wheel_and_severity(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot())
    simulation.set_fault("encoder_lost", wheel=3, severity=0.7)
    run = drive(simulation, 0.2)
    values = run.truth("encoder_lost")[-1]
    assert (values["active"], values["wheel"], values["severity"]) == (1.0, 3.0, 0.7)
    assert run.truth("control_signal_lost")[-1]["active"] == 0.0


def test_parameters_describe_themselves() -> None:
    parameters = all_parameters()
    documented = re.findall(r"^\| `(\w+)`", DOCUMENTED.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(documented) == sorted(fault_ids())
    for name, spec in parameters.items():
        fault_id, setting = split_name(name)
        assert fault_id in fault_ids()
        assert spec.name == setting
        assert spec.description
        assert not spec.read_only
    assert parameters["faults.encoder_lost.severity"].default == 0.0
    assert parameters["faults.floor_slippery.radius"].unit == "m"


@pytest.mark.parametrize(
    ("fault_id", "settings", "message"),
    [
        ("no_such", {}, "'no_such' is unknown: give bearing_dragging, commands_ignored"),
        ("encoder_lost", {"wheel": 4}, r"wheel = 4: out of range, give at least 1, at most 3"),
        ("encoder_lost", {"wheel": 1.5}, "give a whole number"),
        ("encoder_lost", {"severity": 1.2}, "out of range"),
        ("encoder_lost", {"severity": float("nan")}, "give a finite number"),
        ("encoder_lost", {"radius": 1.0}, "no setting 'radius': give wheel, severity"),
        ("control_signal_lost", {"terminals": "loose"}, "give one of open, shorted"),
        ("floor_slippery", {"radius": -1.0}, "out of range"),
    ],
)
def test_bad_settings_are_refused(fault_id: str, settings: dict[str, object], message: str) -> None:
    board = FaultBoard()
    with pytest.raises(InputError, match=message):
        board.set(fault_id, settings)
    assert all(state.severity == 0.0 for state in board.states())
