"""The robots that training draws."""

import pytest
from attrs import asdict

from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions.schema import TwistPhase
from tomr_training.drives import Bump, random_drive
from tomr_training.planar.population import training_drive

REFERENCE = shipped_robot("reference")
OTHER = (0, 1, 4, 5)  # seeds that draw another kind of robot
ALIKE = (2, 3, 6, 7)


def later(bumps: tuple[Bump, ...], known: tuple[Bump, ...]) -> list[Bump]:
    return [bump for bump in bumps if bump not in known]


def torque(robot: Robot, effect: str, wheel: int) -> float:
    values = robot.physics[effect][wheel]
    assert values is not None
    return values["torque"]


def test_every_other_robot_is_tuned() -> None:
    for seed in range(8):
        drive, plain = training_drive(REFERENCE, seed), random_drive(REFERENCE, seed)
        given, own = asdict(plain.plant.controller), asdict(drive.plant.controller)
        changed = {key: own[key] / given[key] for key in own if own[key] != given[key]}
        tuned = set() if seed % 2 else {"proportional", "integral", "acceleration_limit"}
        assert set(changed) == tuned
        assert list(changed.values()) == pytest.approx([1.0] * len(changed), abs=0.05)


def test_some_are_shoved_before_they_start() -> None:
    shoved = 0
    for seed in ALIKE:
        drive, plain = training_drive(REFERENCE, seed), random_drive(REFERENCE, seed)
        early = later(drive.bumps, plain.bumps)
        assert all(bump.start < 1.0 for bump in early)
        shoved += bool(early)
    assert 0 < shoved < len(ALIKE)


@pytest.mark.parametrize("seed", OTHER)
def test_another_kind_is_known_as_well_as_the_others(seed: int) -> None:
    drive, plain = training_drive(REFERENCE, seed), random_drive(REFERENCE, seed)
    for wheel in range(3):
        scale = drive.plant.motors[wheel].resistance / plain.plant.motors[wheel].resistance
        described = plain.believed.motors[wheel].resistance
        assert drive.believed.motors[wheel].resistance == pytest.approx(scale * described)
        assert 0.7 <= scale <= 6.0
        off = drive.plant.motors[wheel].resistance / drive.believed.motors[wheel].resistance
        assert off == pytest.approx(1.0, abs=0.05)
        ratios = [
            torque(drive.plant, effect, wheel) / torque(drive.believed, effect, wheel)
            for effect in ("friction.coulomb", "friction.stribeck")
        ]
        assert ratios == pytest.approx([1.0, 1.0], abs=0.05)


def test_oil_of_other_kinds_is_thicker_or_thinner() -> None:
    def viscous(robot: Robot) -> float:
        values = robot.physics["friction.viscous"][0]
        assert values is not None
        return values["coefficient"]

    scales = [
        viscous(training_drive(REFERENCE, seed).believed)
        / viscous(random_drive(REFERENCE, seed).believed)
        for seed in range(0, 200, 4)
    ]
    assert 0.5 <= min(scales) < 1.0 < 4.0 < max(scales) <= 6.0


def test_other_kinds_are_pushed_about_more_and_longer() -> None:
    more: list[Bump] = []
    for seed in range(0, 80, 4):
        drive, plain = training_drive(REFERENCE, seed), random_drive(REFERENCE, seed)
        # Those before the start, of at most 0.12 s, befall every kind.
        more += [bump for bump in later(drive.bumps, plain.bumps) if bump.start >= 1.0]
    assert len(more) > 5
    assert 0.12 < max(bump.duration for bump in more) <= 0.24


def test_other_kinds_stick_more() -> None:
    scales = [
        torque(training_drive(REFERENCE, seed).believed, "friction.coulomb", 0)
        / torque(random_drive(REFERENCE, seed).believed, "friction.coulomb", 0)
        for seed in range(0, 400, 4)
    ]
    assert min(scales) < 1.0 < 6.0 < max(scales)


@pytest.mark.parametrize("seed", ALIKE)
def test_half_of_the_robots_are_of_the_reference_family(seed: int) -> None:
    drive, plain = training_drive(REFERENCE, seed), random_drive(REFERENCE, seed)
    assert drive.believed == plain.believed
    assert drive.plant.physics == plain.plant.physics


def test_other_kinds_creep_where_they_would_go_straight_and_still_pause() -> None:
    skewed = paused = 0
    for seed in OTHER:
        given = random_drive(REFERENCE, seed).mission.phases
        own = training_drive(REFERENCE, seed).mission.phases
        assert len(own) == len(given)
        for before, after in zip(given, own, strict=True):
            if not isinstance(before, TwistPhase):
                assert after == before
                continue
            assert isinstance(after, TwistPhase)
            assert (after.twist[:2], after.duration) == (before.twist[:2], before.duration)
            assert abs(after.twist[2] - before.twist[2]) <= 0.25
            skewed += after != before
            if not any(before.twist):
                assert after == before
                paused += 1
    assert skewed > 0
    assert paused > 0
