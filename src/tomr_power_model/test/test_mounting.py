"""An IMU beside the wheels while the robot drives."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.mounting import MountingWatch
from tomr_power_model.messages.inertial import rotation
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import GRAVITY, shipped_robot

Array = NDArray[np.float64]
Change = Callable[[Array], Array]

ROBOT = shipped_robot("reference")
START = to_ns(1000.0)
TURNED = rotation((0.0, 0.0, math.pi / 2.0))


def twist(time: float) -> Array:
    """Of a robot that turns, and speeds up and slows down all ways."""
    return np.array([0.4 * math.sin(2.0 * time), 0.3 * math.sin(1.3 * time), math.sin(0.7 * time)])


def measured(time: float) -> Array:
    """By an IMU that is as described."""
    (v_x, v_y, turning), step = twist(time), 1e-4
    a_x, a_y, _ = (twist(time + step) - twist(time - step)) / (2.0 * step)
    return np.array([0.0, 0.0, turning, a_x - turning * v_y, a_y + turning * v_x, GRAVITY])


def turned(values: Array) -> Array:
    """By one that is turned to the left by a right angle."""
    return np.concatenate([values[:3] @ TURNED, values[3:] @ TURNED])


def drive(
    watch: MountingWatch,
    change: Change = lambda values: values,
    *,
    begin: float = 0.0,
    seconds: float = 10.0,
    wheels: Change = lambda twist: twist,
) -> list[float]:
    """Times at which a mistake is found [s]."""
    found = []
    for sample in range(round(100.0 * begin), round(100.0 * (begin + seconds))):
        time = 0.01 * sample
        watch.add(START + to_ns(time - 0.005), change(measured(time - 0.005)).tolist())
        if watch.look(START + to_ns(time), wheels(twist(time))):
            found.append(time)
    return found


def test_one_that_is_as_described_is_believed() -> None:
    watch = MountingWatch(ROBOT)
    assert drive(watch, seconds=60.0) == []
    assert watch.mistake == ""


def test_a_mistake_is_found_once_within_seconds_of_driving() -> None:
    watch = MountingWatch(ROBOT)
    (time,) = drive(watch, turned)
    assert 2.0 < time < 5.0
    assert watch.mistake.endswith("write robot.imu_rpy: [0, 0, 1.5708]")


def test_one_that_was_described_otherwise_is_turned_from_there() -> None:
    """It is given in what the description takes for base_link."""
    watch = MountingWatch(evolve(ROBOT, imu_rpy=(0.0, 0.0, math.pi)))
    drive(watch, turned)
    assert watch.mistake.endswith("write robot.imu_rpy: [0, 0, -1.5708]")


def test_one_that_is_mended_is_believed_again() -> None:
    watch = MountingWatch(ROBOT)
    drive(watch, turned)
    assert drive(watch, begin=10.0, seconds=70.0) == []
    assert watch.mistake == ""


def test_a_leap_of_the_stamps_forgets_no_mistake_and_makes_none() -> None:
    watch = MountingWatch(ROBOT)
    drive(watch, turned)
    watch.clear()
    assert drive(watch, turned, begin=500.0, seconds=3.0) == []
    assert watch.mistake
    leaping = MountingWatch(ROBOT)
    for begin in range(0, 100, 5):
        assert drive(leaping, begin=float(100 - begin), seconds=2.0) == []
        leaping.clear()


def test_wheels_that_are_not_known_show_nothing() -> None:
    watch = MountingWatch(ROBOT)
    assert drive(watch, turned, wheels=lambda twist: twist * math.nan) == []
    assert drive(watch, turned, wheels=lambda twist: twist * 0.0) == []


def test_an_imu_alone_is_not_kept_for_ever() -> None:
    watch = MountingWatch(ROBOT)
    for sample in range(100_000):
        watch.add(START + sample * to_ns(0.01), (0.0,) * 6)
    assert len(watch._samples) < 2000


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_ice_is_no_mistake(share: float) -> None:
    """The wheels turn for ten seconds, and the body does a part of it."""
    watch = MountingWatch(ROBOT)

    def slides(values: Array) -> Array:
        return values * [1.0, 1.0, share, share, share, 1.0]

    assert drive(watch, slides) == []
    assert watch.mistake == ""


def test_driving_round_shows_it_as_well() -> None:
    """At one speed: what it feels is that it turns."""
    watch = MountingWatch(ROBOT)
    for sample in range(1000):
        time = 0.01 * sample
        turning = math.sin(0.7 * time)
        felt = turned(np.array([0.0, 0.0, turning, 0.0, 0.8 * turning, GRAVITY]))
        watch.add(START + to_ns(time), felt.tolist())
        watch.look(START + to_ns(time), np.array([0.8, 0.0, turning]))
    assert watch.mistake.endswith("write robot.imu_rpy: [0, 0, 1.5708]")
