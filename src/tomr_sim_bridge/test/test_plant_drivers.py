"""Wheel speed loops against numbers worked by hand."""

from collections.abc import Callable

import numpy as np
import pytest

from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.drivers import WheelDrivers

MakeRobot = Callable[..., Robot]
PERIOD = 0.005
STILL = np.zeros(3)


def test_command_vector_is_ramped(make_robot: MakeRobot) -> None:
    robot = make_robot({"controller.integral": 0.0})
    drivers = WheelDrivers(robot, PERIOD)
    drivers.command(0, np.array([0.3, 0.4, 1.0]))
    duty = drivers.tick(0, STILL)
    # 2 m/s^2 * 5 ms = 0.01 m/s along (0.6, 0.8); 0.05 rad/s. Wheel 1:
    # (0 * 0.006 - 1 * 0.008 - 0.2 * 0.05) / 0.05 = -0.36 rad/s, times 1.2 V s/rad, of 24 V
    assert duty[0] == pytest.approx(-0.36 * 1.2 / 24.0)
    for _ in range(99):
        duty = drivers.tick(0, STILL)
    # full command: (-0.4 - 0.2) / 0.05 = -12 rad/s
    assert duty[0] == pytest.approx(-12.0 * 1.2 / 24.0)


def test_no_limit_means_no_ramp(make_robot: MakeRobot) -> None:
    changes = {"controller.acceleration_limit": 0.0, "controller.integral": 0.0}
    drivers = WheelDrivers(make_robot(changes), PERIOD)
    drivers.command(0, np.array([0.0, 0.4, 0.0]))
    assert drivers.tick(0, STILL)[0] == pytest.approx(-8.0 * 1.2 / 24.0)


def test_speed_is_that_of_the_last_period(make_robot: MakeRobot) -> None:
    drivers = WheelDrivers(make_robot({"controller.integral": 0.0}), PERIOD)
    drivers.tick(0, STILL)
    duty = drivers.tick(5_000_000, np.array([0.01, 0.0, 0.0]))
    assert duty == pytest.approx([-2.0 * 1.2 / 24.0, 0.0, 0.0])  # 0.01 rad in 5 ms


def test_integral_grows_with_the_error_and_stops_when_saturated(make_robot: MakeRobot) -> None:
    changes = {"controller.acceleration_limit": 0.0}
    drivers = WheelDrivers(make_robot(changes), PERIOD)
    drivers.command(0, np.array([0.0, 0.4, 0.0]))
    first, second = drivers.tick(0, STILL), drivers.tick(0, STILL)
    # 8 rad/s: 9.6 V, and 12 V/rad * 8 rad/s * 5 ms = 0.48 V more each period
    assert first[0] == pytest.approx(-(9.6 + 0.48) / 24.0)
    assert second[0] == pytest.approx(-(9.6 + 0.96) / 24.0)
    for _ in range(100):
        assert drivers.tick(0, STILL)[0] >= -1.0
    # Saturated at 30 steps of 0.48 V; were the sum still growing, 0.4 rad/s would not free it.
    drivers.command(0, np.zeros(3))
    assert -0.61 < drivers.tick(0, STILL)[0] < -0.57


def test_command_waits_for_its_delay(make_robot: MakeRobot) -> None:
    changes = {"controller.delay": 0.1, "controller.acceleration_limit": 0.0}
    drivers = WheelDrivers(make_robot(changes), PERIOD)
    drivers.command(1_000_000_000, np.array([0.0, 0.4, 0.0]))
    assert drivers.tick(1_095_000_000, STILL) == pytest.approx(STILL)
    assert drivers.tick(1_100_000_000, STILL)[0] < 0
