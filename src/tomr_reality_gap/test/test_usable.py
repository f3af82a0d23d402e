"""Recordings that must not be explained: each refused in one line that names place and remedy."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.alignment.usable import (
    refuse_dull,
    refuse_faulty,
    refuse_unfollowed,
    usable,
)

from .test_alignment import _recorded as recorded_drive
from .test_alignment import simulation  # noqa: F401 -- the fixture

Changed = Callable[[Recorded], Recorded]


@pytest.fixture
def robot() -> Robot:
    return shipped_robot("reference")


@pytest.fixture
def recorded(robot: Robot) -> Recorded:
    """The made drive, with a power that belongs to it and noise."""
    made = recorded_drive(robot)
    speed = np.stack(
        [np.interp(made.power_time, made.encoder_time, column) for column in made.velocity.T],
        axis=1,
    )
    noise = np.random.default_rng(0).normal(0.0, 0.05, speed.shape)
    power = 1.2 + 0.3 * np.abs(speed) + 0.1 * speed**2 + noise
    velocity = np.where(made.encoder_time[:, None] < 0.05, 0.0, made.velocity)
    total = power.sum(axis=1) + 12.0
    return evolve(made, velocity=velocity, power=power, reading=power / 24.0, total=total)


def test_a_healthy_recording_is_used_as_it_is(recorded: Recorded, robot: Robot) -> None:
    found = usable(recorded, robot)
    assert found.notes == ()
    assert len(found.power) == len(recorded.power)
    refuse_faulty([recorded], robot)


def test_clocks_that_never_meet_are_refused(recorded: Recorded, robot: Robot) -> None:
    later = evolve(recorded, power_time=recorded.power_time + 1e4)
    with pytest.raises(InputError, match=r"motor power \(10000\.0 to 10030\.0 s\) and encoders"):
        usable(later, robot)


def test_stray_stamps_are_left_out_and_told(recorded: Recorded, robot: Robot) -> None:
    """One sample an hour late must not make the simulation an hour long."""
    time = recorded.total_time.copy()
    time[-1] += 3600.0
    found = usable(evolve(recorded, total_time=time), robot)
    assert found.total_time[-1] < 30.0
    assert len(found.total) == len(recorded.total) - 1
    assert found.notes == (
        "made: 1 samples of battery_state lie outside of the encoders' time: left out",
    )


def test_blank_stretches_are_told(recorded: Recorded, robot: Robot) -> None:
    power, position = recorded.power.copy(), recorded.position.copy()
    power[300:600, 1] = np.nan
    position[:300, 2] = np.nan
    velocity = np.where(np.isnan(position), np.nan, recorded.velocity)
    holed = evolve(recorded, power=power, position=position, velocity=velocity)
    assert usable(holed, robot).notes == (
        "made: 10 % of the encoder of wheel_3_joint are NaN: left out",
        "made: 20 % of wheel_2/power are NaN: left out",
    )


def test_a_recording_that_begins_in_motion_begins_later(recorded: Recorded, robot: Robot) -> None:
    """Cut at 1 s, in the middle of a move: what was commanded before is not in it."""

    def later(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return time[time >= 1.0] - 1.0, time >= 1.0

    encoder_time, encoders = later(recorded.encoder_time)
    power_time, power = later(recorded.power_time)
    command_time, commands = later(recorded.command_time)
    cut = evolve(
        recorded,
        encoder_time=encoder_time,
        position=recorded.position[encoders],
        velocity=recorded.velocity[encoders],
        power_time=power_time,
        power=recorded.power[power],
        reading=recorded.reading[power],
        voltage=recorded.voltage[power],
        total_time=power_time,
        total=recorded.total[power],
        total_voltage=recorded.total_voltage[power],
        command_time=command_time,
        command=recorded.command[commands],
    )
    found = usable(cut, robot)
    assert found.encoder_time[0] > 1.0
    assert found.power_time[0] > 1.0
    assert found.command_time[0] < -10.0
    np.testing.assert_array_equal(found.command[0], found.command[1])
    made = RecordingSimulation.of(found, robot, channels_of(found, robot, 0.005))
    refuse_unfollowed([made], [made.run(robot)])
    assert "it begins in motion" in found.notes[0]


def test_a_wheel_that_tells_next_to_nothing_is_refused(recorded: Recorded, robot: Robot) -> None:
    blank = np.where(np.arange(3) == 0, np.nan, recorded.position)
    dead = evolve(recorded, position=blank, velocity=blank)
    with pytest.raises(InputError, match="wheel_1_joint: 100 % of the encoder's samples are NaN"):
        usable(dead, robot)


def _steady(robot: Robot, twist: tuple[float, float, float]) -> Recorded:
    """Thirty seconds of one motion, after two at rest."""
    made = recorded_drive(robot)
    moving = made.encoder_time >= 2.0
    speed = np.where(moving[:, None], twist_to_wheels(robot) @ twist, 0.0)
    return evolve(made, velocity=speed, position=np.cumsum(speed, axis=0) * 0.01)


def test_one_speed_and_heading_tells_nothing(recorded: Recorded, robot: Robot) -> None:
    creep, other = _steady(robot, (0.05, 0.02, 0.0)), _steady(robot, (0.3, 0.0, 0.0))
    with pytest.raises(InputError, match=r"made: the wheels turn at one speed .* 100 % of the"):
        refuse_dull([creep])
    refuse_dull([creep, other])
    refuse_dull([recorded])


def _clipped(item: Recorded) -> Recorded:
    reading = np.minimum(item.reading, 0.12)
    return evolve(item, reading=reading, power=24.0 * reading)


def _turned(item: Recorded) -> Recorded:
    return evolve(item, velocity=item.velocity[:, [1, 2, 0]], position=item.position[:, [1, 2, 0]])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (_clipped, r"power sensor is saturated: it never passes 0\.12.*--skip made="),
        (lambda item: evolve(item, power=-item.power), "must be negative while power is drawn"),
        (_turned, "this robot.yaml belongs to another robot"),
    ],
)
def test_faulty_sensors_and_other_robots_are_refused(
    changed: Changed, said: str, recorded: Recorded, robot: Robot
) -> None:
    with pytest.raises(InputError, match=said):
        refuse_faulty([changed(recorded)], robot)


def test_commands_that_are_not_those_of_the_drive_are_refused(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    run = simulation.run(simulation.robot)
    refuse_unfollowed([simulation], [run])
    kept = simulation.recorded.command_time < 20.0
    lost = evolve(
        simulation.recorded,
        command_time=simulation.recorded.command_time[kept],
        command=simulation.recorded.command[kept] * np.array([0.0, 0.0, 1.0]),
    )
    deaf = RecordingSimulation.of(lost, simulation.robot, simulation.channels)
    with pytest.raises(InputError, match=r"wheel_1_joint, .*it does not follow its command"):
        refuse_unfollowed([deaf], [deaf.run(deaf.robot)])


def test_a_slow_loop_is_no_fault(simulation: RecordingSimulation) -> None:  # noqa: F811
    """Half a second behind its commands: that is for the explanation to say."""
    late = evolve(simulation.recorded, command_time=simulation.recorded.command_time - 0.5)
    slow = RecordingSimulation.of(late, simulation.robot, simulation.channels)
    refuse_unfollowed([slow], [slow.run(slow.robot)])


def test_wheels_that_turn_backwards_are_refused(simulation: RecordingSimulation) -> None:  # noqa: F811
    run = simulation.run(simulation.robot)
    run = evolve(run, speed=run.speed * np.array([1.0, -1.0, 1.0]))
    with pytest.raises(InputError, match="wheel_2_joint"):
        refuse_unfollowed([simulation], [run])
