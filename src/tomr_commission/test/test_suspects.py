"""Gross mistakes in a description are named."""

from pathlib import Path
from typing import cast

import numpy as np
import pytest
from attrs import evolve

from tomr_commission.suspects import check_values, check_wheels, notes_on
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels, wheels_to_twist
from tomr_power_model.robot import (
    load_robot,
    read_description,
    robot_from_parameters,
    shipped_robot,
)

BAG = Path(__file__).resolve().parents[3] / "bags" / "square"
ROBOT = shipped_robot("reference")
VALUES = dict(read_description("reference"))


@pytest.fixture
def ideal() -> Drive:
    """Wheels that answer at once and exactly to random commands."""
    random = np.random.default_rng(3)
    time = 0.01 * np.arange(4000)
    command = np.repeat(random.uniform(-0.5, 0.5, (40, 3)), 100, axis=0)
    speed = command @ twist_to_wheels(ROBOT, nominal=True).T
    nothing, none = np.full((0, 3), np.nan), np.empty(0)
    return Drive(
        name="ideal",
        encoder_time=time,
        position=np.cumsum(speed, axis=0) * 0.01,
        velocity=speed,
        power_time=none,
        power=nothing,
        reading=nothing,
        total_time=none,
        total=none,
        command_time=time,
        command=command,
        voltage=nothing,
        total_voltage=none,
        imu_time=none,
        inertial=np.empty((0, 6)),
    )


def turned(drive: Drive, matrix: np.ndarray) -> Drive:
    return evolve(drive, position=drive.position @ matrix, velocity=drive.velocity @ matrix)


def test_right_description_passes(ideal: Drive) -> None:
    check_wheels([ideal], ROBOT, "robot.yaml")


def test_two_wheels_swapped(ideal: Drive) -> None:
    swapped = turned(ideal, np.eye(3)[[1, 0, 2]])
    with pytest.raises(
        InputError, match=r"order of the wheels.*\[wheel_2_joint, wheel_1_joint, wheel_3_joint\]"
    ):
        check_wheels([swapped], ROBOT, "robot.yaml")


def test_names_that_are_advised_for_a_cycle_mend_it(ideal: Drive) -> None:
    cycled = turned(ideal, np.eye(3)[[2, 0, 1]])
    with pytest.raises(InputError, match="wheel_names") as caught:
        check_wheels([cycled], ROBOT, "robot.yaml")
    names = str(caught.value).partition("wheel_names: [")[2].partition("]")[0].split(", ")
    # Columns of a drive stand in the order of the description's names.
    columns = [ROBOT.wheel_names.index(name) for name in names]
    mended = evolve(
        cycled, position=cycled.position[:, columns], velocity=cycled.velocity[:, columns]
    )
    check_wheels([mended], ROBOT, "robot.yaml")


def test_encoder_that_counts_backwards(ideal: Drive) -> None:
    with pytest.raises(InputError, match="encoder of wheel_2_joint counts against"):
        check_wheels([turned(ideal, np.diag([1.0, -1.0, 1.0]))], ROBOT, "robot.yaml")


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ((1.0, -1.0, 1.0), "linear.y of the commands has the wrong sign"),
        ((1.0, 1.0, -1.0), "angular.z of the commands has the wrong sign"),
        ((-1.0, -1.0, -1.0), "all wheels turn against their sense"),
    ],
)
def test_wrong_signs(ideal: Drive, axes: tuple[float, float, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_wheels([evolve(ideal, command=ideal.command * axes)], ROBOT, "robot.yaml")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("robot.wheel_radius", 0.1, "write robot.wheel_radius: 0.05"),
        ("robot.wheel_offset", 1.5707963, "write robot.wheel_offset: 0"),
    ],
)
def test_wrong_value(ideal: Drive, key: str, value: float, said: str) -> None:
    described = robot_from_parameters({**VALUES, key: value}, "robot.yaml")
    with pytest.raises(InputError, match=said):
        check_wheels([ideal], described, "robot.yaml")


def test_what_nobody_commanded_shows_nothing_of_the_wheels(ideal: Drive) -> None:
    """That commands are missing is for others to say."""
    silent = evolve(ideal, command_time=np.empty(0), command=np.empty((0, 3)))
    check_wheels([silent], ROBOT, "robot.yaml")
    reversed_too = evolve(ideal, position=-ideal.position, velocity=-ideal.velocity)
    with pytest.raises(InputError, match="turn against their sense"):
        check_wheels([silent, reversed_too], ROBOT, "robot.yaml")


@pytest.mark.parametrize("key", ["motor.gear_ratio", "robot.mass"])
def test_value_twice_too_large(key: str) -> None:
    value = VALUES[key]
    assert isinstance(value, float)
    drive = read_drive(BAG, load_robot("reference"))
    check_values(drive, VALUES, "robot.yaml")
    with pytest.raises(InputError, match=rf"seems half what is described.*{key}"):
        check_values(drive, {**VALUES, key: 2.0 * value}, "robot.yaml")


def test_values_that_fit_as_well_are_all_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomr_commission.suspects._ALIKE", 2.0)
    drive = read_drive(BAG, load_robot("reference"))
    key = "motor.gear_ratio"
    with pytest.raises(InputError) as error:
        check_values(drive, {**VALUES, key: 2.0 * cast(float, VALUES[key])}, "robot.yaml")
    seems, checks = str(error.value).split(": check ")
    assert "the gear ratio seems half or the " in seems
    assert checks.startswith("motor.gear_ratio = 40.0 and ")


def test_what_is_wrong_with_an_imu_is_noted(ideal: Drive) -> None:
    """A drive that turns, by a gyro that turns the other way."""
    twist = ideal.velocity @ wheels_to_twist(ROBOT).T
    inertial = np.full((len(twist), 6), np.nan)
    inertial[:, 2] = -twist[:, 2]
    drive = evolve(ideal, imu_time=ideal.encoder_time, inertial=inertial, notes=("said",))
    said, found = notes_on([drive], ROBOT)
    assert said == "said"
    assert "the gyro of imu/data turns the other way" in found
