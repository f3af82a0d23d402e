"""Stamps, channels and the simulation that is driven by a recording."""

import os

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.simulation import worker_count
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import Channel, channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.basis_responses import basis_responses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.prepared import integrator_of


def _recorded(robot: Robot) -> Drive:
    """Thirty seconds of starts, turns and stops, as the simulation itself would record them."""
    command_time = np.arange(0.0, 30.0, 0.05)
    phase = command_time // 2.5
    command = (
        np.stack(
            [0.4 * np.sin(1.7 * phase), 0.4 * np.cos(2.3 * phase), 0.8 * np.sin(3.1 * phase)],
            axis=1,
        )
        * (phase % 4 != 3)[:, None]
    )
    encoder_time = np.arange(0.0, 30.0, 0.01)
    held = command[np.minimum((encoder_time / 0.05).astype(int), len(command) - 1)]
    speed = held @ twist_to_wheels(robot).T
    power_time = np.arange(0.02, 30.0, 0.02)
    blank = np.zeros((len(power_time), 3))
    return Drive(
        name="made",
        encoder_time=encoder_time,
        position=np.cumsum(speed, axis=0) * 0.01,
        velocity=speed,
        power_time=power_time,
        power=blank,
        reading=blank,
        total_time=power_time,
        total=blank[:, 0],
        command_time=command_time,
        command=command,
        voltage=blank + robot.supply.nominal_voltage,
        total_voltage=blank[:, 0] + robot.supply.nominal_voltage,
        imu_time=np.empty(0),
        inertial=np.empty((0, 6)),
    )


def as_recorded(made: RecordingSimulation, value: np.ndarray) -> RecordingSimulation:
    """The same recording with other values measured."""
    parts = zip(made.channels, rows_of(made.channels), strict=True)
    return evolve(made, channels=tuple(evolve(item, value=value[part]) for item, part in parts))


@pytest.fixture
def simulation() -> RecordingSimulation:
    robot = shipped_robot("reference")
    recorded = _recorded(robot)
    return RecordingSimulation.of(recorded, robot, channels_of(recorded, robot))


def test_a_few_values_make_no_channel() -> None:
    robot = shipped_robot("reference")
    recorded = _recorded(robot)
    few = evolve(
        recorded,
        total_time=recorded.total_time[:9],
        total=recorded.total[:9],
        total_voltage=recorded.total_voltage[:9],
    )
    lost = {channel.name for channel in channels_of(recorded, robot)} - {
        channel.name for channel in channels_of(few, robot)
    }
    assert lost == {"battery_state", "battery_state voltage"}


def test_a_coarse_current_makes_a_channel_of_coarse_power() -> None:
    """Steps of 0.1 A are 2.4 W at 24 V, of each motor and of the whole robot."""
    robot = shipped_robot("reference")
    recorded = _recorded(robot)
    count = len(recorded.power_time)
    current = 0.1 * np.random.default_rng(3).integers(0, 9, (count, 3))
    noise = np.random.default_rng(4).normal(0.0, 0.001, count)
    shown = evolve(
        recorded,
        reading=current,
        power=current * 24.0,
        total=(current[:, 0] + noise) * 24.0,
        total_voltage=np.full(count, 24.0),
    )
    power, *_, total, _ = channels_of(shown, robot)[:5]
    assert power.quantum == pytest.approx(2.4)
    assert total.quantum < 0.01
    assert power.rounding(np.array([4.8, 6.0, 5.4])) == pytest.approx((0.0 + 1.44 + 0.36) / 3.0)
    (total, _) = channels_of(evolve(shown, total=current[:, 0] * 24.0), robot)[3:5]
    assert total.quantum == pytest.approx(2.4)
    assert channels_of(recorded, robot)[0].quantum == 0.0


def test_ten_minutes_are_predicted_as_well_at_the_end_as_at_the_beginning() -> None:
    """By a description that is wrong by a little, of a robot that stops and stands in between."""
    robot = shipped_robot("reference")
    tour = _recorded(robot)
    command_time = np.arange(0.0, 600.0, 0.05)
    long = evolve(
        tour,
        encoder_time=np.arange(0.0, 600.0, 0.05),
        position=np.full((len(command_time), 3), np.nan),
        velocity=np.zeros((len(command_time), 3)),
        command_time=command_time,
        command=np.tile(tour.command, (20, 1)),
        power_time=command_time + 0.02,
    )
    time = long.power_time
    span, value = np.full(len(command_time), 0.005), np.zeros(len(command_time))
    drawn = tuple(Channel(str(wheel), "power", wheel, "W", time, span, value) for wheel in range(3))
    made = RecordingSimulation.of(long, robot, drawn)
    motors = tuple(evolve(motor, resistance=1.02 * motor.resistance) for motor in robot.motors)
    heavier = evolve(robot, mass=1.03 * robot.mass, motors=motors)
    error = np.subtract(*made.predict([robot, heavier])).reshape(3, 20, -1)
    by_tour = np.sqrt((error**2).mean(axis=(0, 2)))
    assert by_tour[0] > 0.01
    assert by_tour[-1] == pytest.approx(by_tour[1], rel=0.05)


def test_sensors_without_sign_show_the_magnitude_of_what_motors_draw_in_all(
    simulation: RecordingSimulation,
) -> None:
    """Terms that are drawn besides included; the whole robot's sensor knows its sign."""
    robot = simulation.robot
    unsigned = evolve(robot, measurement=evolve(robot.measurement, signed=False))
    drawn = np.full(simulation.size, 0.8)
    signed = evolve(simulation, drawn=drawn)
    found = evolve(signed, robot=unsigned).predict([unsigned])[0]
    expected = signed.predict([robot])[0]
    motors = np.concatenate(
        [np.full(len(item.time), item.kind == "power") for item in simulation.channels]
    )
    assert expected[motors].min() < -0.5
    assert expected[~motors].min() < -0.5  # speeds, at least
    np.testing.assert_allclose(found, np.where(motors, np.abs(expected), expected))


def test_drivers_go_on_believing_the_description(simulation: RecordingSimulation) -> None:
    """A robot that is wider than stated turns more slowly, its wheels do not."""
    wider = evolve(simulation.robot, robot_radius=1.1 * simulation.robot.robot_radius)
    stated, other = (simulation.run(robot) for robot in (simulation.robot, wider))
    assert np.abs(stated.speed - other.speed).max() < 0.1 * np.abs(stated.speed).max()
    ratio = float(other.yaw_rate @ stated.yaw_rate / (stated.yaw_rate @ stated.yaw_rate))
    assert ratio == pytest.approx(1.0 / 1.1, abs=0.01)


def test_the_total_is_the_motors_and_the_rest(simulation: RecordingSimulation) -> None:
    values = simulation.predict([simulation.robot])[0]
    parts, at = {}, 0
    for channel in simulation.channels:
        parts[channel.name] = values[at : (at := at + len(channel.time))]
    motors = sum(parts[f"wheel_{number}/power"] for number in (1, 2, 3))
    rest = simulation.robot.supply.auxiliary_power
    np.testing.assert_allclose(parts["battery_state"], motors + rest, rtol=1e-6)


def test_flaws_of_a_sensor_change_what_it_reports_and_nothing_else(
    simulation: RecordingSimulation,
) -> None:
    robot = simulation.robot
    flaw = ({"scale": 1.1}, None, None)
    flawed = evolve(robot, physics={**robot.physics, "sensor.power_scale": flaw})
    values = simulation.predict([robot, flawed])
    at = 0
    for channel in simulation.channels:
        part = slice(at, at := at + len(channel.time))
        factor = 1.1 if channel.name == "wheel_1/power" else 1.0
        np.testing.assert_allclose(values[1, part], factor * values[0, part], rtol=1e-6, atol=1e-9)


def test_a_recording_that_begins_in_motion_goes_on_from_its_earlier_commands(
    simulation: RecordingSimulation,
) -> None:
    """0.14 s after the start: from rest or at full speed it would be elsewhere."""
    begin, drive = 5.14, simulation.recorded
    later, powers = drive.encoder_time >= begin, drive.power_time > begin
    cut = evolve(
        drive,
        encoder_time=drive.encoder_time[later] - begin,
        position=drive.position[later],
        velocity=drive.velocity[later],
        power_time=drive.power_time[powers] - begin,
        power=drive.power[powers],
        reading=drive.reading[powers],
        voltage=drive.voltage[powers],
        command_time=drive.command_time - begin,
        total_time=np.empty(0),
        total=np.empty(0),
        total_voltage=np.empty(0),
    )
    made = RecordingSimulation.of(cut, simulation.robot, channels_of(cut, simulation.robot))
    whole, part = (item.predict([simulation.robot])[0] for item in (simulation, made))
    wanted = next(c.time > begin + 1e-6 for c in simulation.channels if c.name == "wheel_1/power")
    expected = whole[: len(wanted)][wanted][:10]
    assert np.ptp(expected) > 0.5
    np.testing.assert_allclose(part[:10], expected, atol=0.05)


def _power_change(made: RecordingSimulation, effect: str, values: dict[str, float]) -> np.ndarray:
    """What an effect adds to the motors' power."""
    robot = made.robot
    physics = {**robot.physics, effect: (values,) * 3}
    change = np.subtract(*made.predict([evolve(robot, physics=physics), robot]))
    return change[: 3 * len(made.recorded.power_time)]


def test_angles_and_headings_are_those_that_were_measured(simulation: RecordingSimulation) -> None:
    """A ripple half a period farther on is turned over, a slope for who has turned round, too."""
    drive, robot = simulation.recorded, simulation.robot
    ripple = {"torque": 0.05, "order": 6.0, "phase": 0.0}
    farther = evolve(drive, position=drive.position + np.pi / 6.0)
    half_turn = np.pi * twist_to_wheels(robot)[:, 2]
    around = evolve(
        drive, position=drive.position + half_turn * (drive.encoder_time > 1.0)[:, None]
    )
    for effect, values, other in (
        ("drivetrain.torque_ripple", ripple, farther),
        ("body.slope", {"angle": 0.03, "azimuth": 0.5}, around),
    ):
        moved = evolve(simulation, recorded=other)
        found = [_power_change(item, effect, values) for item in (simulation, moved)]
        assert np.corrcoef(*found)[0, 1] < -0.5
        assert min(change.std() for change in found) > 0.05


def test_torques_resist_beside_those_of_the_users_simulation(
    simulation: RecordingSimulation,
) -> None:
    torque = np.full((simulation.timeline.count, 3), 0.02)
    robot, nothing = simulation.robot, np.zeros((1, *torque.shape))
    theirs = evolve(simulation, resisting=torque)
    expected = next(simulation.respond(robot, torque[None]))
    np.testing.assert_array_equal(next(theirs.respond(robot, nothing)), expected)
    np.testing.assert_array_equal(theirs.predict([robot])[0], expected)
    assert np.abs(expected - simulation.predict([robot])[0]).max() > 0.01


def test_torques_change_each_recording_by_its_own_however_they_are_portioned(
    simulation: RecordingSimulation,
) -> None:
    count, robot = simulation.timeline.count, simulation.robot
    first, second = np.random.default_rng(3).normal(0.0, 0.02, (2, 4, count, 3))
    both = Dataset((simulation, simulation))
    found = both.changes(robot, [iter([first]), iter([second[:1], second[1:]])])
    for changes, torques in zip(np.hsplit(found, 2), (first, second), strict=True):
        plain = simulation.predict([robot])[0]
        expected = np.stack(list(simulation.respond(robot, torques))) - plain
        np.testing.assert_allclose(changes, expected, rtol=1e-6, atol=1e-6)


def test_responses_to_smooth_torques_are_those_of_each_recordings_own_motion(
    simulation: RecordingSimulation,
) -> None:
    """Of a drive of other commands, beside another or by itself, over the same knots."""
    drive = simulation.recorded
    halved = evolve(simulation, recorded=evolve(drive, command=0.5 * drive.command))
    robot, speed = simulation.robot, ("wheel speed [rad/s]",)
    pair = basis_responses(Dataset((simulation, halved)), robot, 0.1, only=speed)
    turned = basis_responses(Dataset((halved, simulation)), robot, 0.1, only=speed)
    first, second = np.vsplit(pair.responses[0], 2)
    np.testing.assert_array_equal(np.vsplit(turned.responses[0], 2), [second, first])
    assert np.abs(first - second).max() > 1e-3


def test_power_is_a_mean_over_the_window_of_its_sensor(simulation: RecordingSimulation) -> None:
    sensors = evolve(simulation.robot.sensors, power_window=0.02)
    channels = channels_of(simulation.recorded, evolve(simulation.robot, sensors=sensors))
    spans = {c.kind: c.span for c in channels}
    for kind in ("power", "total", "voltage"):
        np.testing.assert_array_equal(spans[kind], 0.02)


@pytest.mark.parametrize("way", ["backward", "forward"])
def test_the_drivers_sum_is_found_whatever_is_described(
    simulation: RecordingSimulation, way: str
) -> None:
    robot = simulation.robot
    real = evolve(robot, controller=evolve(robot.controller, integrator=way))
    value = evolve(simulation, robot=real).predict([real])[0]
    assert integrator_of(as_recorded(simulation, value)) == way


def test_a_process_among_others_simulates_on_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dask sets the limit for linear algebra; the simulation keeps to it."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert worker_count() == 1
    monkeypatch.delenv("OMP_NUM_THREADS")
    assert worker_count() == len(os.sched_getaffinity(0))
