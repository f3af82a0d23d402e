"""How channels are read: out of a recording, gaps and NaN included, and out of a simulation."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import Channel, channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation

from .test_alignment import _recorded as recorded_drive
from .test_alignment import simulation  # noqa: F401 -- the fixture


@pytest.fixture
def robot() -> Robot:
    return shipped_robot("reference")


@pytest.fixture
def recorded(robot: Robot) -> Drive:
    return recorded_drive(robot)


def _channel(recorded: Drive, robot: Robot, name: str) -> Channel:
    return next(item for item in channels_of(recorded, robot) if item.name == name)


def test_a_gap_of_the_encoders_stays_a_gap(recorded: Drive, robot: Robot) -> None:
    """Nothing is said about the second between 10 and 11 s, and no mean bridges it."""
    kept = (recorded.encoder_time < 10.0) | (recorded.encoder_time >= 11.0)
    holed = evolve(
        recorded,
        encoder_time=recorded.encoder_time[kept],
        position=recorded.position[kept],
        velocity=recorded.velocity[kept],
    )
    whole = _channel(recorded, robot, "wheel_1_joint")
    found = _channel(holed, robot, "wheel_1_joint")
    assert ((whole.time > 10.1) & (whole.time < 10.9)).any()
    assert not ((found.time > 10.1) & (found.time < 11.0)).any()
    assert found.span.max() < 0.06
    assert not ((found.time - found.span < 10.5) & (found.time > 10.5)).any()


def test_what_is_not_a_number_is_left_out(recorded: Drive, robot: Robot) -> None:
    power = recorded.power.copy()
    power[100:200, 0] = np.nan
    position = recorded.position.copy()
    position[1000:1100, 1] = np.nan
    holed = evolve(recorded, power=power, position=position, velocity=np.full((3000, 3), np.nan))
    first, second = (_channel(holed, robot, f"wheel_{number}/power") for number in (1, 2))
    assert len(second.time) - len(first.time) == 100
    speed = _channel(holed, robot, "wheel_2_joint")
    assert np.isfinite(speed.value).all()
    assert not ((speed.time > 10.1) & (speed.time < 10.9)).any()


def test_a_gap_of_the_gyro_stays_a_gap(recorded: Drive, robot: Robot) -> None:
    time = np.delete(np.arange(0.0, 4.0, 0.01), np.arange(202, 250))
    rate = np.where(time < 2.1, 1.0, -1.0)
    inertial = np.zeros((len(time), 6))
    inertial[:, 2] = rate
    found = _channel(evolve(recorded, imu_time=time, inertial=inertial), robot, "imu/data")
    assert set(np.abs(found.value)) == {1.0}
    assert found.span == pytest.approx(np.full(len(found.time), 0.05))
    assert not ((found.time > 2.1) & (found.time < 2.5)).any()


def _flawed(robot: Robot, effect: str, **values: float) -> Robot:
    return evolve(robot, physics={**robot.physics, effect: (values, None, None)})


def test_a_clock_that_is_late_shows_what_was(simulation: RecordingSimulation) -> None:  # noqa: F811
    """What is stamped t is of t - delay, at that wheel alone."""
    delay = 0.013
    first, second = simulation.channels[:2]
    moved = tuple(evolve(item, time=item.time - delay) for item in (first, second))
    earlier = evolve(simulation, channels=moved).predict([simulation.robot])[0]
    late = _flawed(simulation.robot, "sensor.clock_offset", delay=delay)
    found = evolve(simulation, channels=(first, second)).predict([simulation.robot, late])
    count = len(first.time)
    np.testing.assert_allclose(found[1, :count], earlier[:count], rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(found[1, count:], found[0, count:])
    assert np.abs(found[1, :count] - found[0, :count]).max() > 0.5


def test_a_slow_sensor_follows_by_its_time_constant(simulation: RecordingSimulation) -> None:  # noqa: F811
    """y += (x - y) (1 - e^(-h/T)) in every period h, the first value taken as settled."""
    line, lag = simulation.timeline, 0.05
    time = line.start + line.period * np.arange(1.0, line.count + 1.0)
    dense = evolve(
        simulation.channels[0], time=time, span=np.full(line.count, line.period), value=0.0 * time
    )
    made = evolve(simulation, channels=(dense,))
    true, shown = made.predict(
        [simulation.robot, _flawed(simulation.robot, "sensor.power_lag", time_constant=lag)]
    )
    share = 1.0 - np.exp(-line.period / lag)
    np.testing.assert_allclose(np.diff(shown), share * (true[1:] - shown[:-1]), atol=1e-3)
    assert np.abs(shown - true).max() > 1.0
