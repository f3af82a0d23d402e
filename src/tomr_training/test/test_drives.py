"""Random drives: what a seed decides, and what it leaves."""

import pytest
from attrs import evolve

from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import another_drive, every_value, random_drive

FIRST = random_drive(shipped_robot("reference"), 7, "encoder_lost")


def test_another_drive_is_of_the_same_robot_and_healthy() -> None:
    drive = another_drive(FIRST, 8)
    assert (drive.plant, drive.believed) == (FIRST.plant, FIRST.believed)
    assert drive.mission.phases != FIRST.mission.phases
    assert drive.mission.faults == drive.bumps == ()
    assert drive == another_drive(FIRST, 8)
    assert drive.mission.phases != another_drive(FIRST, 9).mission.phases


@pytest.mark.parametrize("kind", ["floor_slippery", "control_signal_lost", "encoder_lost"])
def test_another_drive_has_the_fault_that_is_asked_for(kind: str) -> None:
    drive = another_drive(FIRST, 8, kind)
    (fault,) = drive.mission.faults
    assert fault.fault_id == kind
    assert fault.end is not None
    assert 0.0 < fault.start < fault.end <= drive.length
    assert drive.mission.phases == another_drive(FIRST, 8).mission.phases
    assert {len(another_drive(FIRST, seed, "fault").mission.faults) for seed in range(20)} == {1}
    assert {len(another_drive(FIRST, seed, "any").mission.faults) for seed in range(20)} == {0, 1}


def test_every_value_is_passed_through_but_of_a_ratio_what_it_differs_from_one_by() -> None:
    given = shipped_robot("reference")
    one = {"scale": 1.002}
    drag = {"coefficient": 0.5, "slip": 0.2}
    loss = {"efficiency": 0.5}  # which is never more than its neutral value
    physics = {
        "sensor.encoder_scale": (one, None, one),
        "contact.roller_drag": (drag, drag, drag),
        "electrical.regeneration_loss": (loss, loss, loss),
    }
    off = every_value(evolve(given, physics=physics), lambda value: 1.02 * value)
    assert off.mass == pytest.approx(1.02 * given.mass)
    assert off.motors[1].resistance == pytest.approx(1.02 * given.motors[1].resistance)
    first, second, third = off.physics["sensor.encoder_scale"]
    assert first == pytest.approx({"scale": 1.00204}, abs=1e-9)
    assert (second, third) == (None, first)
    assert off.physics["contact.roller_drag"][2] == pytest.approx(
        {"coefficient": 0.51, "slip": 0.204}
    )
    assert off.physics["electrical.regeneration_loss"][0] == pytest.approx({"efficiency": 0.51})


@pytest.mark.parametrize(
    ("effect", "parameter", "ratio"),
    [
        ("kinematic.wheel_radius", "scale", True),
        ("sensor.power_scale", "scale", True),
        ("contact.roller_drag", "coefficient", False),
        ("friction.coulomb", "torque", False),
        ("body.mass_center_offset", "x", False),
    ],
)
def test_a_ratio_may_be_more_or_less_than_its_neutral_value(
    effect: str, parameter: str, ratio: bool
) -> None:
    assert EFFECTS[effect].parameters[parameter].is_ratio is ratio
