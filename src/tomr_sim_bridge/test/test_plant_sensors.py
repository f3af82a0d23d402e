"""Rates, quanta, noise and messages of the simulated sensors."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.messages.inertial import rotation
from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.moments import LENGTH, Memory, Moment
from tomr_sim_bridge.plant.sensors import Clock
from tomr_sim_bridge.plant.simulation import Simulation

MakeRobot = Callable[..., Robot]
FORWARD = (0.0, 0.4, 0.0)


def test_topics_of_the_contract_at_their_rates(make_robot: MakeRobot, drive: Callable) -> None:
    run = drive(Simulation(make_robot()), 1.0)
    counts = {topic: len(run.stamps(topic)) for topic in {s.topic for s in run.samples}}
    wheels = dict.fromkeys(("wheel_1/power", "wheel_2/power", "wheel_3/power"), 50)
    assert counts == wheels | {
        "joint_states": 100,
        "battery_state": 50,
        "imu/data": 100,
        "odom": 20,
        "ground_truth/odom": 20,
        "ground_truth/faults": 20,
    }
    stamps = [sample.stamp_ns for sample in run.samples]
    assert stamps == sorted(stamps)
    for sample in run.samples:
        stamp = sample.message.fields["header"].fields["stamp"].fields
        assert stamp["sec"] * 1_000_000_000 + stamp["nanosec"] == sample.stamp_ns


def test_power_monitor_rounds_to_its_quanta(make_robot: MakeRobot, drive: Callable) -> None:
    run = drive(Simulation(make_robot()), 4.0, FORWARD, skip=2.0)
    for field in ("voltage", "current"):
        values = run.supply("wheel_1/power", field)
        assert np.abs(values / 1.25e-3 - np.round(values / 1.25e-3)).max() < 1e-6
        assert len(set(values)) > 3
    # noise of 2 mV, and 4 mV at the battery, with the quantum's 0.36 mV
    assert run.supply("wheel_2/power", "voltage").std() == pytest.approx(2e-3, rel=0.25)
    assert run.supply("battery_state", "voltage").std() == pytest.approx(4e-3, rel=0.25)


def test_idle_robot_draws_standby_and_auxiliary_power(
    make_robot: MakeRobot, drive: Callable
) -> None:
    simulation = Simulation(make_robot(ideal=True))
    run = drive(simulation, 0.2, skip=-1.0)
    assert run.motors()[0] == pytest.approx([1.2, 1.2, 1.2])  # from the first reading on
    assert run.power("battery_state")[0] == pytest.approx(15.6)


def test_encoders_count(make_robot: MakeRobot, drive: Callable) -> None:
    robot = make_robot()
    run = drive(Simulation(robot), 1.0, FORWARD)
    counts = run.joints("position") / robot.sensors.encoder_resolution
    assert np.abs(counts - np.round(counts)).max() < 1e-6
    stamps = run.stamps("joint_states") * 1e-9
    speed = np.diff(run.joints("position"), axis=0) / np.diff(stamps)[:, None]
    assert run.joints()[1:] == pytest.approx(speed)


def test_velocity_quantum(make_robot: MakeRobot, drive: Callable) -> None:
    robot = make_robot({"sensors.velocity_resolution": 0.5})
    speed = drive(Simulation(robot), 1.0, FORWARD).joints()
    assert speed / 0.5 == pytest.approx(np.round(speed / 0.5))
    assert speed.min() <= -7.5


def test_imu_feels_gravity_acceleration_and_turning(make_robot: MakeRobot, drive: Callable) -> None:
    simulation = Simulation(make_robot(ideal=True))

    def means(duration: float, command: tuple[float, ...], skip: float) -> tuple:
        fields = drive(simulation, duration, command, skip).fields("imu/data")
        pull = [list(f["linear_acceleration"].fields.values()) for f in fields]
        return np.mean(pull, axis=0), np.mean([f["angular_velocity"].fields["z"] for f in fields])

    pull, _ = means(0.2, (0.0, 1.0, 0.0), skip=0.1)
    assert pull == pytest.approx([0.0, 2.0, 9.80665], abs=0.3)  # the ramp's 2 m/s^2
    means(2.0, (0.0, 0.0, 0.0), 0.0)
    pull, turning = means(2.0, (0.0, 0.0, 0.8), skip=1.5)
    assert turning == pytest.approx(0.8, abs=0.005)
    assert pull == pytest.approx([0.0, 0.0, 9.80665], abs=0.05)


def test_imu_measures_along_its_own_axes(make_robot: MakeRobot, drive: Callable) -> None:
    """Read as it is described, it is in base_link again, to the last bit of its noise."""
    rpy = [math.pi, 0.0, 0.5 * math.pi]
    straight, turned = (
        drive(Simulation(make_robot(given)), 1.0, (0.5, 0.0, 0.4)).fields("imu/data")
        for given in ({}, {"robot.imu_rpy": rpy})
    )
    axes = rotation(rpy)
    for name in ("angular_velocity", "linear_acceleration"):
        seen, known = (
            np.array([list(fields[name].fields.values()) for fields in run])
            for run in (turned, straight)
        )
        assert seen @ axes.T == pytest.approx(known, abs=1e-9)
        assert np.abs(seen - known).max() > 0.1


def test_imu_on_a_slope(make_robot: MakeRobot, drive: Callable) -> None:
    slope = {"physics.body.slope.angle": 0.1, "physics.body.slope.azimuth": 0.0}
    fields = drive(Simulation(make_robot(slope, ideal=True)), 1.0, skip=0.5).fields("imu/data")
    pull = [list(f["linear_acceleration"].fields.values()) for f in fields]
    down, up = -9.80665 * math.sin(0.1), 9.80665 * math.cos(0.1)
    assert np.mean(pull, axis=0) == pytest.approx([down, 0.0, up], abs=0.02)


def test_odometry_follows_the_truth(make_robot: MakeRobot, drive: Callable) -> None:
    run = drive(Simulation(make_robot()), 4.0, (0.3, 0.1, 0.4))
    assert run.place("odom")[-1] == pytest.approx(run.place()[-1], abs=0.01)
    assert np.hypot(*run.place()[-1]) > 0.8


def changed(**parameters: float) -> dict[str, float]:
    return {
        f"physics.sensor.{name.replace('__', '.')}": value for name, value in parameters.items()
    }


def test_flaws_of_the_power_measurement(make_robot: MakeRobot, drive: Callable) -> None:
    def motors(**flaws: float) -> np.ndarray:
        return drive(Simulation(make_robot(changed(**flaws), ideal=True)), 1.0, FORWARD).motors()

    plain = motors()
    assert motors(power_scale__scale=1.1) == pytest.approx(1.1 * plain)
    assert motors(power_bias__power=0.7) == pytest.approx(plain + 0.7)
    late = motors(clock_offset__delay=0.1)  # five readings
    assert late[5:] == pytest.approx(plain[:-5], rel=1e-6)
    lagged = motors(power_lag__time_constant=0.05)
    share = 1.0 - math.exp(-0.02 / 0.05)
    assert lagged[1:] == pytest.approx(lagged[:-1] + share * (plain[1:] - lagged[:-1]))


def test_robot_that_measures_motor_current_without_sign(
    make_robot: MakeRobot, drive: Callable
) -> None:
    measurement = {
        "measurement.quantity": "motor_current",
        "measurement.signed": False,
        "measurement.total": "sum",
    }
    robot = make_robot(measurement, ideal=True)
    run = drive(Simulation(robot), 3.0, FORWARD, skip=1.5)
    assert np.isnan(run.supply("wheel_1/power", "voltage")).all()
    # (0.06 + 0.004 * 8) / 0.7 A backward at wheel 1, (0.06 + 0.004 * 4) / 0.7 A forward at wheel 2
    assert run.supply("wheel_1/power", "current").mean() == pytest.approx(-0.1314, rel=0.05)
    assert run.supply("wheel_2/power", "current").mean() == pytest.approx(-0.1086, rel=0.05)
    assert not run.fields("battery_state")


def test_other_ways_to_publish_power(make_robot: MakeRobot, drive: Callable) -> None:
    def run(source: str) -> Any:
        changes = {"measurement.source": source}
        return drive(Simulation(make_robot(changes, ideal=True)), 1.0, FORWARD)

    motors = run("battery_state").motors()
    array = [fields["data"] for fields in run("multi_array").fields("power")]
    assert np.array(array) == pytest.approx(motors)
    effort = [fields["effort"] for fields in run("joint_effort").fields("joint_states")]
    assert np.array(effort[-1]) == pytest.approx(motors[-1] / 24.0)
    assert {s.topic for s in run("total_only").samples} == {
        "joint_states", "battery_state", "imu/data", "odom", "ground_truth/odom",
        "ground_truth/faults",
    }  # fmt: skip


def test_the_voltages_that_the_drivers_command(make_robot: MakeRobot, drive: Callable) -> None:
    """Steady: back-EMF of 0.7 V s/rad and what drives against friction; not of a lost signal."""
    robot = make_robot({"measurement.motor_voltage": True}, ideal=True)
    run = drive(Simulation(robot), 3.0, FORWARD, skip=1.5)
    volts = np.array([fields["data"] for fields in run.fields("motor_voltage")]).mean(axis=0)
    expected = [-(0.7 * 8.0 + 0.8 * 0.1314), 0.7 * 4.0 + 0.8 * 0.1086]
    assert volts[:2] == pytest.approx(expected, rel=0.01)
    assert len(run.stamps("motor_voltage")) == len(run.stamps("wheel_1/power"))


@given(
    rate=st.floats(1.0, 1000.0),
    jitter=st.floats(0.0, 0.1),
    seed=st.integers(0, 100),
)
def test_stamps_keep_their_order_and_their_mean_rate(rate: float, jitter: float, seed: int) -> None:
    clock = Clock(rate, 5_000, jitter, np.random.default_rng(seed))
    until = 5_000 + round(20.4 / rate * 1e9)
    stamps = [s for now in range(5_000, until, round(3e8 / rate)) for s in clock.due(now)]
    assert all(later > earlier for earlier, later in pairwise(stamps))
    for count, stamp in enumerate(stamps):
        assert abs(stamp - 5_000 - count * 1e9 / rate) <= 0.4e9 / rate + 1.0


def test_jitter_moves_the_readings_with_the_stamps(make_robot: MakeRobot, drive: Callable) -> None:
    run = drive(Simulation(make_robot(ideal=True), stamp_jitter=0.002), 3.0, FORWARD, skip=2.0)
    stamps = run.stamps("joint_states")
    assert np.diff(stamps).std() > 1e6
    moved = np.polyfit(stamps - stamps[0], run.joints("position")[:, 0], 1)
    assert moved[0] * 1e9 == pytest.approx(-8.0, rel=0.002)
    assert np.abs(np.polyval(moved, stamps - stamps[0]) - run.joints("position")[:, 0]).max() < 2e-3


def test_memory_reads_between_moments_and_forgets() -> None:
    memory = Memory(Moment(0, np.zeros(LENGTH)), depth_ns=20)
    for stamp in range(10, 101, 10):
        memory.append(Moment(stamp, np.full(LENGTH, float(stamp))))
    assert memory.at(95)[0] == pytest.approx(95.0)
    assert memory.at(80)[0] == pytest.approx(80.0)
    assert memory.at(500)[0] == pytest.approx(100.0)
    assert memory.at(0)[0] >= 70.0  # forgotten: the oldest that is left
