"""Stamps, channels and the simulation that is driven by a recording."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.commands import shift_between
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.alignment.steady import steadied, steady


def test_jitter_is_taken_off_and_gaps_are_kept() -> None:
    grid = np.delete(np.arange(500) * 0.01, np.arange(200, 230))
    noisy = grid + np.random.default_rng(1).normal(0.0, 5e-4, len(grid))
    assert np.abs(steady(noisy) - grid).max() < 1e-4
    assert np.diff(steady(noisy)).max() == pytest.approx(0.31, abs=1e-3)


def test_stamps_without_a_grid_are_left_alone() -> None:
    time = np.sort(np.random.default_rng(2).uniform(0.0, 5.0, 300))
    np.testing.assert_array_equal(steady(time), time)


def _recorded(robot: Robot) -> Recorded:
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
    return Recorded(
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
        yaw_time=np.empty(0),
        yaw_rate=np.empty(0),
    )


@pytest.fixture
def forward() -> Forward:
    robot = shipped_robot("reference")
    recorded = _recorded(robot)
    return Forward.of(recorded, robot, channels_of(recorded, robot, 0.005))


def test_stretches_side_by_side_are_the_recording_in_one_piece(forward: Forward) -> None:
    """Cutting the time line must not show: each stretch has forgotten how it began."""
    line = forward.timeline
    assert len(line.first) > 3
    whole = evolve(line, first=line.first[:1], length=line.count)
    cut = forward.predict([forward.robot])[0]
    single = evolve(forward, timeline=whole).predict([forward.robot])[0]
    power = forward.channels[0]
    assert power.kind == "power"
    difference = np.abs(cut - single)[: len(power.time)]
    assert difference.max() < 0.02 * np.ptp(single[: len(power.time)])


def test_the_total_is_the_motors_and_the_rest(forward: Forward) -> None:
    values = forward.predict([forward.robot])[0]
    parts, at = {}, 0
    for channel in forward.channels:
        parts[channel.name] = values[at : (at := at + len(channel.time))]
    motors = sum(parts[f"wheel_{number}/power"] for number in (1, 2, 3))
    rest = forward.robot.supply.auxiliary_power
    np.testing.assert_allclose(parts["battery_state"], motors + rest, rtol=1e-6)


def test_flaws_of_a_sensor_change_what_it_reports_and_nothing_else(forward: Forward) -> None:
    robot = forward.robot
    flaw = ({"scale": 1.1}, None, None)
    flawed = evolve(robot, physics={**robot.physics, "sensor.power_scale": flaw})
    values = forward.predict([robot, flawed])
    at = 0
    for channel in forward.channels:
        part = slice(at, at := at + len(channel.time))
        factor = 1.1 if channel.name == "wheel_1/power" else 1.0
        np.testing.assert_allclose(values[1, part], factor * values[0, part], rtol=1e-6, atol=1e-9)


def test_jittered_recordings_are_told_from_steady_ones() -> None:
    recorded = _recorded(shipped_robot("reference"))
    jitter = np.random.default_rng(3).normal(0.0, 4e-4, len(recorded.encoder_time))
    assert not steadied(recorded)[1]
    even, changed = steadied(evolve(recorded, encoder_time=recorded.encoder_time + jitter))
    assert changed
    assert np.abs(even.encoder_time - recorded.encoder_time).max() < 1e-4


def test_the_shift_between_recordings_of_the_same_commands(forward: Forward) -> None:
    later = evolve(forward.recorded, command_time=forward.recorded.command_time + 0.7)
    assert shift_between(forward.recorded, later) == pytest.approx(0.7, abs=1e-6)


def test_other_commands_are_no_simulation_of_a_recording(forward: Forward) -> None:
    other = evolve(forward.recorded, command=forward.recorded.command[::-1])
    assert shift_between(forward.recorded, other) is None
