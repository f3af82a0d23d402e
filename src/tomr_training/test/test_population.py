"""The robots that training draws, how well they are known, and what befalls them."""

from collections import Counter

import numpy as np
import pytest

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions.schema import TwistPhase
from tomr_training.drives import random_drive
from tomr_training.planar.faults import is_load
from tomr_training.planar.generate import simulate
from tomr_training.planar.hidden import LEFT_OUT, MOST_EFFECTS
from tomr_training.planar.population import (
    PER_ROBOT,
    bands_of,
    training_drive,
    training_robot,
)

REFERENCE = shipped_robot("reference")
NUMBERS = range(60)


def value(robot: Robot, effect: str, key: str = "torque", wheel: int = 0) -> float:
    values = robot.physics[effect][wheel]
    assert values is not None
    return values[key]


def test_drives_in_a_row_are_of_one_robot_and_differ() -> None:
    first, second = (training_drive(REFERENCE, PER_ROBOT * 5 + k) for k in (0, 1))
    other = training_drive(REFERENCE, PER_ROBOT * 6)
    assert first.believed == second.believed
    assert first.plant.motors == second.plant.motors
    assert first.mission.phases != second.mission.phases
    assert first.believed != other.believed


def test_two_of_three_robots_are_commissioned_and_lack_some_physics() -> None:
    robots = [training_robot(REFERENCE, number) for number in NUMBERS]
    assert sum(robot.is_commissioned for robot in robots) == 40
    for robot in robots:
        given, real = robot.drive.believed.physics, robot.drive.plant.physics
        hidden = set(real) - set(given)
        assert hidden <= set(LEFT_OUT)
        assert (1 <= len(hidden) <= MOST_EFFECTS) == robot.is_commissioned
        most = 0.03 if robot.is_commissioned else 0.05
        ratio = robot.drive.plant.mass / robot.drive.believed.mass
        assert ratio == pytest.approx(1.0, abs=most)


def test_own_bands_hold_what_their_own_healthy_driving_shows() -> None:
    """Where a robot is commissioned; the others have those of any robot."""
    assert bands_of(REFERENCE, 3) == BandSettings()
    own = bands_of(REFERENCE, 7)
    assert own.power < BandSettings().power
    compared = simulate(training_robot(REFERENCE, 7).drive).compared
    residual, band = compared.residuals(own)
    # Another drive than that which they come of, with a payload maybe.
    assert np.mean(np.abs(residual[:, 1:4]) < band[:, 1:4]) > 0.98


def test_every_other_robot_is_of_another_kind_and_known_as_well() -> None:
    ratios = []
    for number in NUMBERS:
        robot, plain = training_robot(REFERENCE, number), random_drive(REFERENCE, number, None)
        own, given = robot.drive.believed, plain.believed
        scale = own.motors[0].resistance / given.motors[0].resistance
        assert robot.is_of_another_kind == (number % 2 == 0)
        if not robot.is_of_another_kind:
            assert own == given
            continue
        assert 0.7 <= scale <= 6.0
        ratios.append(value(own, "friction.coulomb") / value(given, "friction.coulomb"))
        off = robot.drive.plant.motors[0].resistance / own.motors[0].resistance
        assert off == pytest.approx(1.0, abs=0.05)
    assert min(ratios) < 1.0 < 5.0 < max(ratios)


def test_drivers_are_not_known_to_the_last_digit() -> None:
    for number in NUMBERS:
        robot = training_robot(REFERENCE, number).drive
        ratio = robot.plant.controller.integral / robot.believed.controller.integral
        tuned = number % 3 != 0 or number // 2 % 2 == 0
        assert (ratio != 1.0) == tuned
        assert ratio == pytest.approx(1.0, abs=0.05)


def test_all_kinds_of_faults_befall_them() -> None:
    kinds = Counter(
        tuple(fault.fault_id for fault in training_drive(REFERENCE, seed).mission.faults)
        for seed in range(400)
    )
    assert 50 < kinds[()] < 120
    assert sum(count for faults, count in kinds.items() if len(faults) == 2) > 5
    assert len({faults for faults in kinds if len(faults) == 1}) == 13


def test_some_slippery_floors_are_a_load_as_well() -> None:
    faults = [
        fault for seed in range(200) for fault in training_drive(REFERENCE, seed).mission.faults
    ]
    slippery = [fault for fault in faults if fault.fault_id == "floor_slippery"]
    assert 0 < sum(is_load(fault) for fault in slippery) < len(slippery)


def test_pushes_are_of_all_sizes_up_to_a_shove() -> None:
    """Of 3 N per kg for 0.2 s, and some lean on it for seconds."""
    sizes, durations = [], []
    for seed in range(120):
        drive = training_drive(REFERENCE, seed)
        for bump in drive.bumps:
            sizes.append(np.hypot(*bump.force) / drive.believed.mass)
            durations.append(bump.duration)
    assert 3.0 < max(sizes) < 3.3
    assert 0.2 < sorted(durations)[int(0.9 * len(durations))] < 0.3
    assert 2.0 < max(durations) <= 4.0


def test_commissioned_robots_meet_floors_at_an_angle_and_gusts() -> None:
    known, unknown = training_drive(REFERENCE, PER_ROBOT * 7), training_drive(REFERENCE, 0)
    assert 0.0 < value(known.plant, "body.slope", "angle") <= 0.04
    force = max(np.hypot(*gust.force) for gust in known.gusts) / known.believed.mass
    assert 0.0 < force < 0.6
    assert not unknown.gusts
    assert "body.slope" not in unknown.plant.physics


def test_other_kinds_creep_where_they_would_go_straight_and_still_pause() -> None:
    skewed = paused = 0
    for seed in (0, 1, 2, 3):
        drive = training_drive(REFERENCE, seed)
        for phase in drive.mission.phases:
            if isinstance(phase, TwistPhase):
                along, across, turning = phase.twist
                skewed += bool(along or across) and 0.0 < abs(turning) <= 0.25
                paused += not any(phase.twist)
    assert skewed > 0
    assert paused > 0
